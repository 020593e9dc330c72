"""What every model keeps to, whatever is inside: one test over all files of conf/model."""

from contextlib import nullcontext
from dataclasses import is_dataclass
from pathlib import Path

import numpy as np
import pytest
import torch
from conftest import CLOCK, ROOT, TABLE, composed
from omegaconf import OmegaConf

import dnnvss.systems
from dnnvss.errors import DnnvssError
from dnnvss.export.graph import frame_streams
from dnnvss.features import FeatureTable, phones_of
from dnnvss.files import digest
from dnnvss.systems import Example, VisualModel
from dnnvss.systems.base import READABLE
from dnnvss.systems.blend import BlendedNetworks
from dnnvss.systems.frame_network import FrameNetwork
from dnnvss.systems.network import NetworkModel
from dnnvss.systems.registry import declared, driven_by, make_system, null_systems, read_system, systems
from dnnvss.training.arrays import save_arrays
from dnnvss.training.checkpoints import load_checkpoint, save_checkpoint
from dnnvss.training.learnt import read_learnt

FILES = sorted(p.stem for p in (ROOT / "conf" / "model").glob("*.yaml") if p.stem != "auto")
NAMES = [name for name in FILES if name != "hsmm_visemes"]
"""All but the one that needs dynamic visemes (test_systems_hsmm_visemes.py)."""
SOURCE: dict[str, object] = {"checkpoint": "none", "digest": "", "model": {"system": "kernel"}}
WIDTHS = {"hidden": "[64,64]", "width": 48}
"""Of networks, which need not be as wide as they are in earnest."""
SMALL = ["trainer.progress=false", "trainer.epochs=3", "trainer.figure_every=0", "trainer.batch_size=32",
         "trainer.accelerator=cpu", "trainer.utterances=1"]


def build(name: str, *given: str, table: FeatureTable = TABLE) -> VisualModel:
    """Return the untrained system of a file of ``conf/model``."""
    config = composed("train", f"model={name}", *SMALL, *given)
    settings: dict = OmegaConf.to_container(config.model, resolve=True)  # type: ignore[assignment]
    assert settings["name"] == name
    if name == "adapted":
        settings["sources"] = {"another": SOURCE}
    return make_system(name, settings, table, CLOCK)


def build_narrow(name: str) -> VisualModel:
    """Return the untrained system of a file with few units."""
    network = composed("train", f"model={name}").model.get("network") or {}
    return build(name, *(f"model.network.{key}={width}" for key, width in WIDTHS.items() if key in network))


def test_every_system_has_a_file_and_every_file_a_system() -> None:
    named = {OmegaConf.load(ROOT / "conf" / "model" / f"{name}.yaml").get("system") for name in FILES} - {None}
    assert named == set(systems()) - {"a_new_one"}  # of the test below, where that ran first
    for cls in systems().values():
        assert cls.reads <= READABLE and is_dataclass(cls.Settings)


def test_a_new_system_is_a_class_in_a_module_of_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a_new_one.py").write_text("""
from dnnvss.systems.phone_mean import PhoneMean

class ANewOne(PhoneMean):
    system = "a_new_one"
    null = False
""")
    monkeypatch.setattr(dnnvss.systems, "__path__", [*dnnvss.systems.__path__, str(tmp_path)])
    assert type(make_system("mine", {"system": "a_new_one"}, TABLE, CLOCK)).__name__ == "ANewOne"
    assert "a new one" not in null_systems(TABLE, CLOCK)


@pytest.mark.parametrize("name", NAMES)
def test_a_name_that_is_no_setting_is_refused(name: str) -> None:
    with pytest.raises(DnnvssError, match=r"model\.moumbers is no setting"):
        build(name, "+model.moumbers=2")


@pytest.mark.parametrize("given, message", [
    ("model.network.kind=feedfoward", r"model\.network\.kind=feedfoward is no setting.*feedforward\?"),
    ("model.network.hidden=512", r"model\.network\.hidden=512 is no list"),
    ("model.network.hidden=[]", r"model\.network\.hidden=\[\] is no network"),
    ("+model.network.hiden=[8]", r"model\.network\.hiden is no setting.*model\.network\.hidden\?"),
    ("model.members=two", r"model\.members=two is no whole number"),
    ("model.system=newtork", r"model\.system=newtork is no setting.*model\.system=network\?"),
    ("trainer.epochs=abc", r"trainer\.epochs=abc is no whole number"),
    ("+trainer.epoch=3", r"trainer\.epoch is no setting.*trainer\.epochs\?")])
def test_mistakes_are_told_under_the_names_that_a_user_gives(given: str, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        build("feedforward", given)


@pytest.mark.parametrize("name", NAMES)
def test_labels_that_a_system_does_not_read_are_refused(name: str) -> None:
    table = FeatureTable((*TABLE.names, "centre_viseme"), TABLE.settings)
    with nullcontext() if "visemes" in build(name).reads else pytest.raises(
            DnnvssError, match=f"model={name} does not look at the dynamic visemes of the labels"):
        assert build(name, table=table).table is table


def test_null_models_are_found_by_what_they_say_of_themselves() -> None:
    assert list(null_systems(TABLE, CLOCK)) == ["training mean", "phone mean"]


@pytest.mark.parametrize("name, blocks, inputs", [
    ("cca", ("logmel",), "voice"), ("cca", ("centre_phone",), "text"), ("feedforward", ("centre_phone", "logmel"),
    "voice and text"), ("guided", ("logmel",), "voice and text"), ("hsmm", ("centre_phone",), "text"),
    ("phone_mean", ("logmel",), "text"), ("training_mean", ("centre_phone",), "nothing")])
def test_what_drives_a_system(name: str, blocks: tuple[str, ...], inputs: str) -> None:
    cls, _ = read_system("network" if name == "feedforward" else name, {})
    assert driven_by(cls, FeatureTable(blocks)) == inputs


def test_kinds_of_networks_are_found_by_name() -> None:
    assert declared(FrameNetwork, "kind")["feedforward"].__name__ == "FeedForward"


@pytest.fixture(scope="module", autouse=True)
def source(examples: dict[str, list[Example]], tmp_path_factory: pytest.TempPathFactory) -> None:
    """A fitted system for those that learn from one."""
    model = make_system("kernel", {}, TABLE, CLOCK)
    model.fit(examples["val"], [], path := tmp_path_factory.mktemp("source"))
    kept = save_arrays(path / "model.npz", {"state": model.state()})
    SOURCE.update(checkpoint=str(kept), digest=digest(kept))


@pytest.fixture(scope="module", params=NAMES)
def fitted(request: pytest.FixtureRequest, examples: dict[str, list[Example]],
           tmp_path_factory: pytest.TempPathFactory) -> tuple[str, VisualModel]:
    model = build_narrow(request.param)
    model.fit(examples["train"], examples["val"], tmp_path_factory.mktemp(request.param))
    return request.param, model


def test_prediction_has_a_gaussian_for_every_frame(fitted: tuple[str, VisualModel], examples: dict) -> None:
    for example in examples["test"]:
        prediction = fitted[1].predict(example)
        assert prediction.mean.shape == example.targets.shape
        variance = np.broadcast_to(prediction.variance, prediction.mean.shape)
        assert np.isfinite(prediction.mean).all() and np.isfinite(variance).all() and (variance > 0).all()


def test_durations_where_learnt_are_positive_for_every_phone(fitted: tuple[str, VisualModel], examples: dict) -> None:
    durations = fitted[1].phone_durations(examples["test"][0])
    assert (durations is None) == (fitted[0] not in ("hsmm", "ensemble", "network_trees"))
    if durations is not None:
        assert durations.shape == phones_of(examples["test"][0].codes).code.shape and (durations > 0).all()


def test_state_is_plain_and_restores_the_model(fitted: tuple[str, VisualModel], examples: dict, tmp_path: Path) -> None:
    name, model = fitted
    kept = save_arrays(tmp_path / "model.npz", model.state())
    save_checkpoint(older := tmp_path / "model.pt", load_checkpoint(kept))  # tensors, as runs of before have them
    for path in (kept, older):
        other = build_narrow(name)
        other.load_state(read_learnt(path))
        for example in examples["test"]:
            np.testing.assert_array_equal(other.predict(example).mean, model.predict(example).mean)
            np.testing.assert_array_equal(other.predict(example).variance, model.predict(example).variance)


def test_prediction_does_not_depend_on_earlier_ones(fitted: tuple[str, VisualModel], examples: dict) -> None:
    first, second = examples["test"]
    before = fitted[1].predict(first).mean
    fitted[1].predict(second)
    np.testing.assert_array_equal(fitted[1].predict(first).mean, before)


def test_fit_starts_anew_and_comes_to_the_same(fitted: tuple[str, VisualModel], examples: dict,
                                                tmp_path: Path) -> None:
    name, model = fitted
    again = build_narrow(name)
    again.fit(examples["train"][:4], examples["val"], tmp_path / "some")
    fewer = again.predict(examples["test"][0]).mean
    again.fit(examples["train"], examples["val"], tmp_path / "all")
    expected = model.predict(examples["test"][0])
    np.testing.assert_array_equal(again.predict(examples["test"][0]).mean, expected.mean)
    np.testing.assert_array_equal(again.predict(examples["test"][0]).variance, expected.variance)
    assert not np.array_equal(fewer, expected.mean)


def test_networks_are_exported_and_others_refused(fitted: tuple[str, VisualModel], examples: dict) -> None:
    model = fitted[1]
    if not isinstance(model, NetworkModel | BlendedNetworks):
        with pytest.raises(DnnvssError, match="is not a network, so it cannot be exported"):
            frame_streams(model)
        return
    codes = examples["test"][0].codes
    frames = np.arange(len(codes))
    inputs = torch.from_numpy(codes.active(frames)).long(), torch.from_numpy(codes.numeric(frames))
    with torch.no_grad():
        mean, variance = frame_streams(model)(*inputs)
    expected = model.predict(examples["test"][0])
    np.testing.assert_allclose(mean, expected.mean, atol=1e-4)
    np.testing.assert_allclose(variance, np.broadcast_to(expected.variance, mean.shape), rtol=1e-3)


def test_every_model_but_the_mean_beats_the_mean(fitted: tuple[str, VisualModel], examples: dict) -> None:
    name, model = fitted
    targets = np.concatenate([e.targets[:, 0] for e in examples["train"]])
    error = np.mean((np.concatenate([model.predict(e).mean[:, 0] for e in examples["train"]]) - targets) ** 2)
    share = error / targets.var(0).mean()
    assert share == pytest.approx(1, abs=1e-5) if name == "training_mean" else share < 0.9
