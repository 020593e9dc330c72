"""Exported networks say what the trained ones say, carry what their numbers mean, and refuse what is no network."""

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch
from conftest import CLOCK, TABLE, of_layers

from dnnvss.acoustics import LogMel
from dnnvss.curves import STATIC_DELTA_DELTA2
from dnnvss.errors import DnnvssError
from dnnvss.export.description import KEY, Description
from dnnvss.export.exported import ExportedModel
from dnnvss.export.graph import FrameStreams, frame_streams
from dnnvss.export.write import write_network
from dnnvss.features import FeatureTable, NumericScaler, Settings, encode
from dnnvss.media import Sound
from dnnvss.runs.bundling import export_run
from dnnvss.systems import Example, Prediction, VisualModel
from dnnvss.systems.blend import BlendedNetworks
from dnnvss.systems.network import NetworkModel
from dnnvss.systems.phone_mean import PhoneMean
from dnnvss.timing import Tier
from dnnvss.training import FitSettings

NUMBERS = ("centre_phone", "phone_context", "phone_span", "phone_frames")
DIMENSIONS = 3


def trained(members: int, variances: bool, table: FeatureTable = TABLE, seed: int = 0,
            network: Mapping[str, Any] = MappingProxyType(of_layers(16, 12))) -> NetworkModel:
    """Return a system with drawn weights and statistics: parity does not need a fit."""
    rng = np.random.default_rng(seed)
    torch.manual_seed(seed)
    model = NetworkModel(table, CLOCK, NetworkModel.Settings(network, FitSettings(), members, variances))
    shape = (3, DIMENSIONS)
    model.mean_, model.deviation_ = (rng.uniform(0.5, 2, shape).astype(np.float32) for _ in range(2))
    model.variance_ = rng.uniform(0.5, 2, shape)
    numeric = table.numeric_width
    model.scaler_ = NumericScaler(rng.normal(size=numeric).astype(np.float32),
                                  rng.uniform(1, 3, numeric).astype(np.float32))
    model.networks_ = [model._new_network().eval() for _ in range(members)]
    return model


def described(model: VisualModel, streams: FrameStreams) -> Description:
    return Description("test", model.table, CLOCK, STATIC_DELTA_DELTA2, ("a", "b", "c"), {"mean": [], "deviation": []},
                       {"mean": streams.get_buffer("target_mean").tolist()}, streams.predicted, streams.reach)


def exported(model: VisualModel, path: Path) -> ExportedModel:
    if path.suffix == ".onnx":
        pytest.importorskip("onnxscript", reason="the extra `export` is not installed")
        pytest.importorskip("onnxruntime", reason="the extra `export` is not installed")
    streams = frame_streams(model)
    write_network(path, streams, described(model, streams))
    return ExportedModel.open(path) if path.suffix == ".onnx" else program(path)


@pytest.fixture(scope="module")
def fine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A network as ONNX."""
    exported(trained(1, False), path := tmp_path_factory.mktemp("fine") / "fine.onnx")
    return path


def program(path: Path) -> ExportedModel:
    """What another program makes of a ``.pt2`` that it trusts."""
    extra = {KEY: ""}
    module = torch.export.load(path, extra_files=extra).module()

    def forward(active: np.ndarray, numeric: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        with torch.inference_mode():
            mean, variance = module(torch.from_numpy(active), torch.from_numpy(numeric))
        return mean.numpy(), variance.numpy()

    return ExportedModel(Description.from_json(extra[KEY]), forward)


def agree(ours: Prediction, theirs: Prediction) -> None:
    assert ours.mean.shape == theirs.mean.shape
    np.testing.assert_allclose(ours.mean, theirs.mean, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(ours.variance, np.broadcast_to(theirs.variance, theirs.mean.shape), rtol=2e-5)


@pytest.mark.parametrize("suffix", [".onnx", ".pt2"])
def test_a_mixture_that_predicts_variances_says_the_same_in_other_programs(
        examples: dict[str, list[Example]], tmp_path: Path, suffix: str) -> None:
    model = trained(2, True)
    first, second = examples["test"]
    network = exported(model, tmp_path / f"model{suffix}")
    for e in (first, second):  # any number of frames
        agree(network.predict(e), model.predict(e))
    several = replace(first, alternatives=(first.codes,))
    agree(network.predict(several), model.predict(several))
    assert network.description == described(model, frame_streams(model))
    if suffix == ".onnx":  # plain JSON for other programs
        held = {p.key: p.value for p in pytest.importorskip("onnx").load(tmp_path / "model.onnx").metadata_props}
        told = json.loads(held[KEY])
        assert told["padding"] == TABLE.binary_width and told["windows"]["taps"][1] == [-0.5, 0.0, 0.5]
        assert [b["name"] for b in told["table"]["blocks"]] == list(TABLE.names)


@pytest.mark.parametrize("suffix", [".onnx", ".pt2"])
@pytest.mark.parametrize("blocks", [("logmel", "logmel_window"), (*NUMBERS, "logmel_window")])
def test_the_sound_says_the_same_in_other_programs(
        examples: dict[str, list[Example]], tmp_path: Path, suffix: str, blocks: tuple[str, ...]) -> None:
    table = FeatureTable(blocks, Settings(logmel=LogMel(bands=6), logmel_offsets=(-5, 5)))
    model = trained(2, False, table)
    network = exported(model, tmp_path / f"model{suffix}")
    assert network.table == table
    for k, e in enumerate(examples["test"]):
        sound = Sound(np.random.default_rng(k).normal(0, 0.1, round(16000 * e.alignment.end)), 16000)
        heard = replace(e, codes=encode(e.alignment, "word", table, CLOCK, sound))
        agree(network.predict(heard), model.predict(heard))


OVER_TIME = [pytest.param({**settings, "width": 8}, suffix, marks=[] if fast else pytest.mark.slow)
             for settings, suffix, fast in (
    ({"kind": "recurrent", "cell": "lstm"}, ".onnx", True), ({"kind": "recurrent", "cell": "lstm"}, ".pt2", False),
    ({"kind": "recurrent", "cell": "gru"}, ".onnx", False), ({"kind": "recurrent", "cell": "gru"}, ".pt2", True),
    ({"kind": "recurrent", "lookahead": 3}, ".onnx", False),
    ({"kind": "convolutional", "dilations": [1, 2]}, ".onnx", True),
    ({"kind": "convolutional", "dilations": [1, 2], "lookahead": 3}, ".pt2", False))]


@pytest.mark.parametrize("network, suffix", OVER_TIME)
def test_networks_over_time_say_the_same_in_other_programs(
        examples: dict[str, list[Example]], tmp_path: Path, network: dict[str, Any], suffix: str) -> None:
    model = trained(2, True, network=network)
    theirs = exported(model, tmp_path / f"model{suffix}")
    assert theirs.description.reach == model.networks_[0].reach != (0, 0)
    for e in examples["test"]:  # of different lengths
        agree(theirs.predict(e), model.predict(e))


def test_predicted_variances_count_where_labels_disagree(examples: dict[str, list[Example]]) -> None:
    model = trained(2, True)
    first = examples["test"][0]
    other = encode(first.alignment.with_tier(Tier("phones", [(first.alignment.start, first.alignment.end, "AA")])), "w",
                   TABLE, CLOCK)
    both = replace(first, alternatives=(other,))
    streams = frame_streams(model)

    def forward(active: np.ndarray, numeric: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        with torch.inference_mode():
            mean, variance = streams(torch.from_numpy(active), torch.from_numpy(numeric))
        return mean.numpy(), variance.numpy()

    agree(ExportedModel(described(model, streams), forward).predict(both), model.predict(both))


def test_blended_networks_of_two_tables_are_one_graph(examples: dict[str, list[Example]]) -> None:
    table = FeatureTable((*NUMBERS[:2], "centre_viseme", *NUMBERS[2:]))
    model = BlendedNetworks(table, CLOCK, BlendedNetworks.Settings(of_layers(8), FitSettings(), weight=0.3))
    parts = [trained(1, False, t, seed) for t, seed in ((model.phone_table, 1), (table, 2))]
    parts[0].mean_, parts[0].deviation_, parts[0].scaler_ = (getattr(parts[1], n)
                                                             for n in ("mean_", "deviation_", "scaler_"))
    model.phones, model.all, model.variance_ = *parts, parts[1].variance_
    e = examples["test"][0]
    visemes = Tier("visemes", [(s.start, s.end, str(i % 7)) for i, s in enumerate(e.alignment["phones"])])
    example = replace(e, codes=encode(e.alignment.with_tier(visemes), "word", table, CLOCK))
    streams, frames = frame_streams(model), np.arange(len(example.codes))
    with torch.inference_mode():
        mean, variance = streams(torch.from_numpy(example.codes.active(frames).astype(np.int64)),
                                 torch.from_numpy(example.codes.numeric(frames)))
    agree(Prediction(mean.numpy(), variance.numpy()), model.predict(example))


def test_what_is_no_network_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DnnvssError, match="PhoneMean is not a network"):
        frame_streams(PhoneMean(TABLE, CLOCK))
    run: Any = SimpleNamespace(folder="runs/a", trained=PhoneMean(TABLE, CLOCK),
                               settings=SimpleNamespace(model_name="phone_mean"))
    with pytest.raises(DnnvssError, match=r"runs/a: model=phone_mean is not a network.*bundle of it: --out FOLDER"):
        export_run(run, tmp_path / "model.onnx")
    streams = frame_streams(model := trained(1, False))
    with pytest.raises(DnnvssError, match=r"as \.bin.*\.onnx"):
        write_network(tmp_path / "model.bin", streams, described(model, streams))


def test_damaged_files_and_other_tables_are_named(fine: Path, tmp_path: Path) -> None:
    path = tmp_path / "model.onnx"
    path.write_bytes(fine.read_bytes()[:1000])
    with pytest.raises(DnnvssError, match=r"model.onnx: is no ONNX file, or was cut short"):
        ExportedModel.open(path)
    with pytest.raises(DnnvssError, match=r"model.pt2: is no ONNX file"):
        ExportedModel.open(tmp_path / "model.pt2")
    with pytest.raises(DnnvssError, match="no such file"):
        ExportedModel.open(tmp_path / "nothing.onnx")
    for text in ("", "{}", '{"version": 99}'):
        with pytest.raises(DnnvssError, match="Export the run again"):
            Description.from_json(text)


def test_an_onnx_file_that_does_more_than_a_network_is_not_opened(fine: Path, tmp_path: Path) -> None:
    onnx = pytest.importorskip("onnx")

    def refused(change: Callable[[Any], None], what: str) -> None:
        model = onnx.load(fine)
        change(model)
        (tmp_path / "odd.onnx").write_bytes(model.SerializeToString())
        with pytest.raises(DnnvssError, match=f"odd.onnx: holds {what}"):
            ExportedModel.open(tmp_path / "odd.onnx")

    def outside(model: Any) -> None:
        tensor = model.graph.initializer[0]
        tensor.ClearField("raw_data")
        tensor.data_location = onnx.TensorProto.EXTERNAL
        tensor.external_data.add(key="location", value="/etc/passwd")

    def loop(model: Any) -> None:
        body = onnx.helper.make_graph([], "body", [], [])
        model.graph.node.add(op_type="Loop").attribute.append(onnx.helper.make_attribute("body", body))

    def hidden(model: Any) -> None:
        body = onnx.helper.make_graph([], "body", [], [])
        model.graph.node[0].attribute.append(onnx.helper.make_attribute("body", body))

    refused(outside, "numbers in another file")
    refused(loop, "the operation 'Loop'")
    refused(hidden, "a graph inside its graph")
    refused(lambda m: m.graph.node.add(op_type="Add", domain="evil"), "operations of 'evil'")
    refused(lambda m: m.functions.add(name="f", domain="d"), "functions")
