"""Networks over time: padding changes nothing, a look-ahead is kept, streams say what whole utterances do."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from conftest import CLOCK, TABLE
from torch import nn

from dnnvss.curves import STATIC_DELTA_DELTA2, mlpg
from dnnvss.errors import DnnvssError
from dnnvss.features import CodeStore, FeatureTable, NumericScaler
from dnnvss.systems import Example
from dnnvss.systems.blend import BlendedNetworks
from dnnvss.systems.frame_network import FrameNetwork, NetworkPlan
from dnnvss.systems.members import widest_layer
from dnnvss.systems.network import NetworkModel
from dnnvss.systems.parts import pieces
from dnnvss.systems.recurrent import RecurrentCore
from dnnvss.training import FitSettings
from dnnvss.training.regression import UtteranceRegression
from dnnvss.training.utterances import LONGEST, UtteranceBatches, parts_of

BINARY, NUMERIC, OUT = 20, 3, 5
BOTH = ({"kind": "recurrent", "width": 6}, {"kind": "recurrent", "width": 6, "cell": "gru"},
        {"kind": "convolutional", "width": 6})
CAUSAL = tuple({**settings, "lookahead": 4} for settings in BOTH)
FIT = FitSettings(epochs=3, utterances=3, share=1.0, progress=False, figure_every=0, accelerator="cpu")
every = pytest.mark.parametrize("settings", (*BOTH, *CAUSAL), ids=lambda s: "-".join(map(str, s.values())))
causal = pytest.mark.parametrize("settings", CAUSAL, ids=lambda s: "-".join(map(str, s.values())))


def built(settings: Mapping[str, object], dropout: float = 0.0) -> FrameNetwork:
    torch.manual_seed(1)
    plan = NetworkPlan.read({**settings, "dropout": dropout})
    return plan.build(binary=BINARY, numeric=NUMERIC, active=4, out=OUT).eval()


def drawn(*lengths: int) -> list[tuple[torch.Tensor, torch.Tensor]]:
    torch.manual_seed(2)
    return [(torch.randint(0, BINARY + 1, (n, 4), dtype=torch.int32), torch.randn(n, NUMERIC)) for n in lengths]


def joined(parts: list[tuple[torch.Tensor, torch.Tensor]]) -> tuple[torch.Tensor, torch.Tensor]:
    return torch.cat([a for a, _ in parts]), torch.cat([n for _, n in parts])


@every
def test_padding_changes_neither_outputs_nor_gradients(settings: dict) -> None:
    network, parts = built(settings), drawn(30, 7, 1, 18)
    alone = torch.cat([network(*part) for part in parts])
    alone.square().sum().backward()
    expected = [p.grad.clone() for p in network.parameters() if p.grad is not None]
    network.zero_grad()
    together = network(*joined(parts), torch.tensor([30, 7, 1, 18]))
    torch.testing.assert_close(together, alone)
    together.square().sum().backward()
    found = [p.grad for p in network.parameters() if p.grad is not None]
    torch.testing.assert_close(found, expected, rtol=1e-4, atol=1e-4)


@every
def test_an_output_depends_on_no_frame_beyond_the_look_ahead(settings: dict) -> None:
    network, (active, numeric) = built(settings), drawn(60)[0]
    numeric.requires_grad_()
    network(active, numeric)[20].sum().backward()
    assert numeric.grad is not None
    seen = numeric.grad.abs().sum(1).nonzero().flatten().tolist()
    ahead = settings.get("lookahead")
    if ahead is not None:
        assert network.lookahead == ahead and seen[-1] == 20 + ahead and min(seen) < 20
    elif settings["kind"] == "convolutional":
        before, after = network.reach
        assert before == after == 32 and (min(seen), max(seen)) == (0, 52)
    else:
        assert network.lookahead is None and (min(seen), max(seen)) == (0, 59)


@causal
@pytest.mark.parametrize("sizes", [(1,) * 25, (25,), (7, 0, 11, 7)])
def test_a_stream_says_what_the_whole_utterance_says(settings: dict, sizes: tuple[int, ...]) -> None:
    network, (active, numeric) = built(settings), drawn(25)[0]
    stream, found, came = network.stream(), [], 0
    with torch.no_grad():
        for size in sizes:
            found.append(stream.push(active[came : came + size], numeric[came : came + size]))
            came += size
            assert sum(map(len, found)) == max(came - 4, 0)  # as early as the look-ahead lets it
        found.append(stream.finish())
        torch.testing.assert_close(torch.cat(found), network(active, numeric), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("cell", ["lstm", "gru"])
def test_both_ways_are_those_of_torch(cell: str) -> None:
    """Against torch's own bidirectional layers on packed sequences."""
    torch.manual_seed(0)
    core = RecurrentCore(cell, 5, 4, 2, True, 0.0)
    theirs = {"lstm": nn.LSTM, "gru": nn.GRU}[cell](5, 4, 2, bidirectional=True, batch_first=True)
    for name, value in theirs.named_parameters():
        kind, place = name.rsplit("_l", 1)
        layer = core.layers[int(place[0])][int(place.endswith("_reverse"))]  # type: ignore[index]
        value.data.copy_(layer.cell.get_parameter(f"{kind}_l0"))
    rows, lengths = torch.randn(3, 9, 5), torch.tensor([9, 2, 6])
    packed = nn.utils.rnn.pack_padded_sequence(rows, lengths, batch_first=True, enforce_sorted=False)
    expected, _ = nn.utils.rnn.pad_packed_sequence(theirs(packed)[0], batch_first=True)
    mask = torch.arange(9) < lengths[:, None]
    torch.testing.assert_close(core(rows, mask)[mask], expected[mask])


def test_a_convolution_by_hand() -> None:
    """Without norms: 1, 10, 100 under a kernel of ones make sums of neighbours, zeros outside."""
    network: Any = built({"kind": "convolutional", "width": 1, "kernel": 3, "dilations": [1]})
    block = network.rest.core.blocks[0]
    block.norm = nn.Identity()
    block.conv.weight.data.fill_(1.0)
    block.conv.bias.data.zero_()
    rows = torch.tensor([[[1.0], [10.0], [100.0]]])
    added = nn.functional.gelu(torch.tensor([11.0, 111.0, 110.0]))
    torch.testing.assert_close(block(rows)[0, :, 0], rows[0, :, 0] + added)


@pytest.mark.parametrize("settings, message", [
    ({"kind": "recurrent", "cell": "rnn"}, r"model\.network\.cell=rnn is unknown"),
    ({"kind": "recurrent", "lookahead": -1}, r"lookahead=-1 is too little|lookahead=-1"),
    ({"kind": "convolutional", "kernel": 4}, r"kernel=4 has no centre"),
    ({"kind": "convolutional", "dilations": []}, r"dilations=\[\] is no network")])
def test_sizes_that_make_no_network_are_refused(settings: dict, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        NetworkPlan.read(settings)


def test_long_utterances_go_through_in_pieces() -> None:
    network = built({"kind": "recurrent", "width": 6})
    active, numeric = drawn(20000)[0]
    with torch.no_grad():
        whole = network(active, numeric)
        parts = [network(active[a], numeric[a])[b] for a, b in pieces(len(active), network.reach)]
    assert len(parts) == 2
    torch.testing.assert_close(torch.cat(parts), whole, rtol=1e-5, atol=1e-6)


def batches(examples: list[Example], seed: int | None = 0, share: float = 1.0, size: int = 3) -> Any:
    store = CodeStore.join((e.id, e.codes) for e in examples)
    targets = np.concatenate([e.measured[0] for e in examples]).reshape(len(store), -1)
    valid = np.concatenate([e.measured[1] for e in examples])
    return UtteranceBatches(store, NumericScaler.fit(store), targets, valid, size, share, seed)


def test_batches_hold_each_utterance_once_and_whole(examples: dict[str, list[Example]]) -> None:
    made = batches(examples["train"])
    drawn = list(made)
    assert len(drawn) == len(made) == 3 and drawn[0][4].numel() == 3
    found = {tuple(t.numpy().ravel()) for _, _, targets, _, counts in drawn for t in targets.split(counts.tolist())}
    assert found == {tuple(e.measured[0].ravel()) for e in examples["train"]}
    again, made.epoch = list(made), lambda: 1
    assert torch.equal(drawn[0][0], again[0][0]) and not torch.equal(drawn[0][4], next(iter(made))[4])
    assert sum(b[4].numel() for b in batches(examples["train"], share=0.5)) == 4


def test_processes_that_share_a_fit_share_the_utterances(examples: dict[str, list[Example]]) -> None:
    whole, parts = batches(examples["train"], size=4), []
    for rank in range(2):
        part = batches(examples["train"], size=4)
        part.place = partial(lambda number: (number, 2), rank)
        parts.append(next(iter(part)))
    counts = next(iter(whole))[4].tolist()
    assert [p[4].tolist() for p in parts] == [counts[::2], counts[1::2]]


def test_long_utterances_are_cut_in_training() -> None:
    assert parts_of(np.array([0, 10]), np.array([10, 2 * LONGEST + 1])) == [
        (0, 10), (10, 2010), (2010, 4011), (4011, 6011)]


def test_frames_that_were_not_measured_do_not_count(examples: dict[str, list[Example]]) -> None:
    batch = next(iter(batches(examples["train"])))
    objective = UtteranceRegression(FIT, 3, 3)
    outputs = torch.randn(len(batch[2]), 9)
    some = (torch.arange(len(outputs)) % 3 > 0)
    told = objective.loss(lambda *given: outputs, (*batch[:3], some, batch[4]))
    torch.testing.assert_close(told, objective.error(outputs[some], batch[2][some]))
    assert objective.loss(lambda *given: outputs, (*batch[:3], some & False, batch[4])) is None


@pytest.mark.parametrize("variances", [False, True])
@causal
def test_a_causal_system_streams_what_it_predicts(settings: dict, variances: bool, tmp_path: Path,
                                                  examples: dict[str, list[Example]]) -> None:
    model = NetworkModel(TABLE, CLOCK, NetworkModel.Settings(settings, replace(FIT, epochs=1), members=2,
                                                           variances=variances))
    model.fit(examples["train"], examples["val"], tmp_path)
    codes, stream = examples["test"][0].codes, model.stream()
    found = []
    for first in range(0, len(codes), 3):
        frames = np.arange(first, min(first + 3, len(codes)))
        found.append(stream.push(codes.active(frames), codes.numeric(frames)))
    found.append(stream.finish())
    expected = model.predict(examples["test"][0])
    np.testing.assert_allclose(np.concatenate([p.mean for p in found]), expected.mean, rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(np.concatenate([p.variance for p in found]), expected.variance, rtol=1e-4)
    mean, variance = model.predictor(examples["test"][0])(slice(3, len(codes) - 2))
    np.testing.assert_allclose(mean, expected.mean[3:-2], rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(variance, expected.variance[3:-2], rtol=1e-4)


@pytest.mark.parametrize("settings", BOTH[::2], ids=lambda s: s["kind"])
def test_refinement_and_blends_work_with_them(settings: dict, tmp_path: Path,
                                              examples: dict[str, list[Example]]) -> None:
    fit = replace(FIT, refine=2, refine_rate=1e-3)
    model = NetworkModel(TABLE, CLOCK, NetworkModel.Settings(settings, fit, variances=True))
    model.fit(examples["train"], examples["val"], tmp_path / "alone")

    def error() -> float:
        found = [(mlpg((p := model.predict(e)).mean, p.variance), e.measured[0][:, 0]) for e in examples["val"]]
        return float(np.mean([np.square((x - y) / model.deviation_[0]).mean() for x, y in found]))

    before = error()
    model.refine(examples["train"], examples["val"], partial(mlpg, windows=STATIC_DELTA_DELTA2), tmp_path / "refined")
    assert error() < before
    blend = BlendedNetworks(TABLE, CLOCK, BlendedNetworks.Settings(settings, FIT))
    blend.fit(examples["train"], examples["val"], tmp_path / "blend")
    e = examples["test"][0]
    parts = [part.predict(e).mean for part in (blend.phones, blend.all)]
    np.testing.assert_allclose(blend.predict(e).mean, (parts[0] + parts[1]) / 2, rtol=1e-5, atol=1e-6)
    assert not np.allclose(parts[0], parts[1])


def test_a_system_that_sees_the_whole_utterance_does_not_stream(tmp_path: Path,
                                                                examples: dict[str, list[Example]]) -> None:
    model = NetworkModel(TABLE, CLOCK, NetworkModel.Settings(BOTH[0], FIT))
    model.fit(examples["train"], examples["val"], tmp_path)
    with pytest.raises(DnnvssError, match="looks at the whole utterance"):
        model.stream()


def test_what_comes_before_matters(tmp_path: Path, examples: dict[str, list[Example]]) -> None:
    """A parameter that follows a phone by 15 frames, where only the present phone is seen."""
    table = FeatureTable(("centre_phone",))

    def late(e: Example) -> Example:
        targets, _ = e.measured
        targets = np.concatenate([targets[:1].repeat(15, 0), targets[:-15]])
        return replace(e, targets=targets, codes=e.codes.with_table(table))

    train, val = ([late(e) for e in examples[name]] for name in ("train", "val"))
    settings = replace(FIT, epochs=60, utterances=2, learning_rate=1e-2, batch_size=64)
    errors = {}
    for kind in ("feedforward", "recurrent"):
        size = {"hidden": [24]} if kind == "feedforward" else {"width": 24, "layers": 1, "lookahead": 0}
        model = NetworkModel(table, CLOCK, NetworkModel.Settings({"kind": kind, **size}, settings))
        model.fit(train, val, tmp_path / kind)
        errors[kind] = np.mean([np.square(model.predict(e).mean - e.measured[0])[:, 0].mean() for e in train])

    assert errors["recurrent"] < 0.6 * errors["feedforward"]


@pytest.mark.parametrize("settings", [*BOTH, *CAUSAL, {"kind": "feedforward", "hidden": [7, 30, 4]}])
def test_settings_tell_the_widest_layer_behind_the_first(settings: dict[str, object]) -> None:
    """Names of runs depend on it: beyond the base width the rate falls with it."""
    layers = [layer for layer in built(settings).modules() if isinstance(layer, nn.Linear)]
    assert widest_layer({"network": settings}) == max(layer.in_features for layer in layers)
