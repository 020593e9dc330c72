"""One fit for several talkers: what each takes from it, what others leave alone, and that small ones are heard."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from conftest import CLOCK, TABLE, make_example, of_layers

from dnnvss.face.base import APERTURE, Gauge
from dnnvss.features import CodeStore
from dnnvss.systems import Example
from dnnvss.systems.frame_network import NetworkPlan
from dnnvss.systems.network import NetworkModel, NetworkSettings
from dnnvss.systems.talkers import TalkerCodes, TalkersFit, TalkersNetwork, repeats
from dnnvss.training.settings import FitSettings

Split = dict[str, list[Example]]
SIZES = {"binary": TABLE.binary_width, "numeric": TABLE.numeric_width, "active": TABLE.active_width}
QUICK = {"progress": False, "figure_every": 0, "accelerator": "cpu", "batch_size": 64, "share": 1.0, "utterances": 2}
RECURRENT = {"kind": "recurrent", "layers": 1, "width": 8}


def settings(epochs: int = 2, network: dict | None = None, **more: object) -> NetworkSettings:
    return NetworkSettings(network or of_layers(16), FitSettings(**{**QUICK, "epochs": epochs}), **more)


@pytest.fixture(scope="module")
def talkers(examples: Split) -> dict[str, Split]:
    """A talker with three parameters and one of whom there are two sentences, with two."""
    rng = np.random.default_rng(7)
    few = [make_example(f"train{i}", rng) for i in range(4)]
    few = [replace(e, targets=e.measured[0][:, :, 1:] * np.float32(-4) + np.float32(9)) for e in few]
    return {"ann": examples, "bob": {"train": few[:2], "val": few[2:3], "test": few[3:]}}


def given(talkers: dict[str, Split], kind: str) -> dict[str, list[Example]]:
    return {name: own[kind] for name, own in talkers.items()}


@pytest.mark.parametrize("network", [of_layers(8, 8), RECURRENT])
def test_the_network_of_a_talker_says_what_the_shared_one_says_with_the_code(network: dict, examples: Split) -> None:
    shared = TalkersNetwork(NetworkPlan.read(network), SIZES, [3, 2], rows=3)
    with torch.no_grad():
        for weight in shared.parameters():
            weight.uniform_(-0.3, 0.3)
        shared.inside.get_parameter("first.weight")[-1] = 0
    shared.eval()
    codes = CodeStore.join({"a": examples["val"][0].codes})
    frames = np.arange(len(codes))
    numeric = torch.from_numpy(codes.numeric(frames))
    for talker, size in enumerate((3, 2)):
        own = TalkerCodes(codes, np.full(len(codes), talker), 2)
        with torch.no_grad():
            told = shared(torch.from_numpy(own.active(frames)), numeric).reshape(-1, 3, 3)
            alone = shared.of(talker).eval()(torch.from_numpy(codes.active(frames)), numeric).reshape(-1, 3, size)
        torch.testing.assert_close(told[:, :, :size], alone, atol=1e-5, rtol=1e-5)
        assert not told[:, :, size:].any() and alone.std() > 0.01


def test_what_talkers_share_is_theirs_together_and_goes_with_the_fit(examples: Split) -> None:
    shared = TalkersNetwork(NetworkPlan.read(of_layers(8)), SIZES, [3, 2], rows=3, shared=1)
    codes = CodeStore.join({"a": examples["val"][0].codes})
    own = TalkerCodes(codes, np.ones(len(codes), int), 2)
    frames = np.arange(len(codes))
    told = shared(torch.from_numpy(own.active(frames)), torch.from_numpy(codes.numeric(frames))).unflatten(1, (3, 4))
    assert not told[:, :, 2].any()  # the parameter that this talker's face has not
    told[:, :, 3].square().sum().backward()
    last = list(shared.inside.parameters())[-1].grad
    assert last is not None and len(last) == 18 and not last[:15].any() and last[15:].all()
    assert shared.of(0).out == 9 and shared.of(1).out == 6


def test_gauges_of_the_lips_are_told_in_the_talkers_own_deviations(talkers: dict[str, Split], tmp_path: Path) -> None:
    def face(*vector: float) -> SimpleNamespace:
        return SimpleNamespace(gauges={APERTURE: Gauge(APERTURE, np.array(vector), 5.0),
                                       **({"nose": Gauge("nose", np.array(vector), 0.0)} if len(vector) == 3 else {})})

    faces = {"ann": face(1, 2, 0), "bob": face(0, -3)}
    fit = TalkersFit(TABLE, CLOCK, settings(1), 0.5, faces)  # type: ignore[arg-type]
    told: list[np.ndarray] = []
    real = fit._batches

    def watched(scaler: object, told_of: dict, *more: object) -> object:
        told.extend(told_of[name](np.concatenate([e.measured[0] for e in talkers[name]["train"]])) for name in told_of)
        return real(scaler, told_of, *more)  # type: ignore[arg-type]

    fit._batches = watched  # type: ignore[method-assign, assignment]
    fitted = fit(given(talkers, "train"), given(talkers, "val"), tmp_path)
    for name, rows in zip(talkers, told, strict=False):
        values = rows.reshape(len(rows), 3, 4)[:, :, 3]  # three parameters at most, one gauge
        np.testing.assert_allclose(values.std(axis=0), 1, atol=1e-3)
        static = np.concatenate([e.measured[0][:, 0] for e in talkers[name]["train"]]).astype(float)
        aperture = faces[name].gauges[APERTURE](static)
        np.testing.assert_allclose(values[:, 0], (aperture - aperture.mean()) / aperture.std(), atol=1e-3)
        assert fitted[name].predict(talkers[name]["test"][0]).mean.shape[2] == len(faces[name].gauges[APERTURE].vector)


def test_a_frame_teaches_the_outputs_of_its_own_talker_alone(examples: Split) -> None:
    shared = TalkersNetwork(NetworkPlan.read(of_layers(8)), SIZES, [3, 2], rows=3)
    codes = CodeStore.join({"a": examples["val"][0].codes})
    own = TalkerCodes(codes, np.ones(len(codes), int), 2)
    frames = np.arange(len(codes))
    shared(torch.from_numpy(own.active(frames)), torch.from_numpy(codes.numeric(frames))).square().sum().backward()
    last = list(shared.inside.parameters())[-1].grad
    assert last is not None and not last[:9].any() and last[9:].all()


def test_codes_on_a_device_are_those_of_the_host(examples: Split) -> None:
    codes = CodeStore.join({"a": examples["val"][0].codes, "b": examples["test"][0].codes})
    own = TalkerCodes(codes, np.repeat([0, 1], [len(examples["val"][0].codes), len(examples["test"][0].codes)]), 2)
    frames = np.arange(len(codes))[::7]
    here, there = own.active(frames), own.to("cpu").active(torch.from_numpy(frames))
    np.testing.assert_array_equal(here, there.numpy())
    plain = codes.active(frames)
    padding = plain == TABLE.binary_width
    np.testing.assert_array_equal(here[:, :-1][~padding], plain[~padding])
    assert (here[:, :-1][padding] == TABLE.binary_width + 2).all() and set(here[:, -1] - TABLE.binary_width) == {0, 1}


def test_small_talkers_are_passed_over_more_often() -> None:
    assert repeats([900, 100, 90], 0) == [1, 1, 1]
    assert repeats([900, 100, 90], 1) == [1, 9, 10]
    assert repeats([900, 100, 90], 0.5) == [1, 3, 3]


@pytest.mark.parametrize("network, more", [(of_layers(16), {}), (RECURRENT, {}), (of_layers(16), {"variances": True}),
                                           (of_layers(16), {"members": 2})])
def test_each_talker_gets_a_network_of_the_usual_kind(network: dict, more: dict, talkers: dict[str, Split],
                                                      tmp_path: Path) -> None:
    own = settings(network=network, **more)
    fitted = TalkersFit(TABLE, CLOCK, own, 0.5)(given(talkers, "train"), given(talkers, "val"), tmp_path)
    for name, model in fitted.items():
        example = talkers[name]["test"][0]
        said = model.predict(example)
        assert said.mean.shape == example.measured[0].shape and np.isfinite(said.mean).all()
        again = NetworkModel(TABLE, CLOCK, own)
        again.load_state(model.state())
        np.testing.assert_array_equal(again.predict(example).mean, said.mean)


def test_a_talker_of_two_sentences_learns_from_another(talkers: dict[str, Split], tmp_path: Path) -> None:
    own = settings(40)
    fitted = TalkersFit(TABLE, CLOCK, own, 1.0)(given(talkers, "train"), given(talkers, "val"), tmp_path / "joint")
    bob = talkers["bob"]
    alone = NetworkModel(TABLE, CLOCK, own)
    alone.fit(bob["train"], bob["val"], tmp_path / "alone")
    test = bob["test"][0]

    def error(model: NetworkModel) -> float:
        return float((model.predict(test).mean - test.measured[0])[:, 0].std() / test.measured[0][:, 0].std())

    assert error(fitted["bob"]) < error(alone) - 0.02


def test_figures_of_the_fit_are_those_of_the_first_talker(talkers: dict[str, Split], tmp_path: Path) -> None:
    shown = replace(settings(1), fit=replace(settings(1).fit, figure_every=1))
    TalkersFit(TABLE, CLOCK, shown, 0.5)(given(talkers, "train"), given(talkers, "val"), tmp_path)
    events = b"".join(path.read_bytes() for path in (tmp_path / "tensorboard").glob("events*"))
    assert b"PNG" in events and b"trajectory" in events


def test_a_fit_that_was_killed_goes_on_to_the_same_weights(talkers: dict[str, Split], tmp_path: Path,
                                                           monkeypatch: pytest.MonkeyPatch) -> None:
    train, val = given(talkers, "train"), given(talkers, "val")
    whole = TalkersFit(TABLE, CLOCK, settings(4), 0.5)(train, val, tmp_path / "whole")
    from dnnvss.training.callbacks import Watch

    kept, calls = Watch.on_validation_end, []

    def killed(self: Watch, *more: object) -> None:
        calls.append(1)
        if len(calls) == 3:
            raise KeyboardInterrupt
        kept(self, *more)  # type: ignore[arg-type]

    with monkeypatch.context() as patched, pytest.raises(BaseException):  # noqa: B017
        patched.setattr(Watch, "on_validation_end", killed)
        TalkersFit(TABLE, CLOCK, settings(4), 0.5)(train, val, tmp_path / "killed")
    again = TalkersFit(TABLE, CLOCK, settings(4), 0.5)(train, val, tmp_path / "killed")
    for name, model in whole.items():
        np.testing.assert_array_equal(again[name].predict(talkers[name]["test"][0]).mean,
                                      model.predict(talkers[name]["test"][0]).mean)
