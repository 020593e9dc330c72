"""Pieces chosen by a trajectory: the sentence's own where it is the guide, the joining ones where targets tie."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import CLOCK, TABLE, of_layers
from face.face_cases import rig

from dnnvss.errors import DnnvssError
from dnnvss.systems import Example, Prediction
from dnnvss.systems.guided import GuidedCodebook, _ramped
from dnnvss.systems.network import NetworkModel
from dnnvss.systems.plain_network import PlainNetwork
from dnnvss.training import FitSettings

SETTINGS = FitSettings(epochs=1, batch_size=32, progress=False, figure_every=0, accelerator="cpu")


def guided(**settings: object) -> GuidedCodebook:
    return GuidedCodebook(TABLE, CLOCK, GuidedCodebook.Settings(of_layers(8), SETTINGS, **settings))


@pytest.fixture(scope="module")
def model(examples: dict[str, list[Example]], tmp_path_factory: pytest.TempPathFactory) -> GuidedCodebook:
    fitted = guided()
    fitted.fit(examples["train"], examples["val"], tmp_path_factory.mktemp("guided"))
    return fitted


def told(model: GuidedCodebook, monkeypatch: pytest.MonkeyPatch, mean: np.ndarray) -> None:
    monkeypatch.setattr(model, "stretch_", np.ones(1))
    monkeypatch.setattr(model.book, "settings", replace(model.book.settings, cutoff=None))
    monkeypatch.setattr(model, "examples", 1)
    monkeypatch.setattr(model.leader, "predict", lambda example: Prediction(mean, np.ones(1)))


def test_a_guide_that_was_recorded_comes_back_as_itself(model: GuidedCodebook, examples: dict[str, list[Example]],
                                                        monkeypatch: pytest.MonkeyPatch) -> None:
    example = examples["train"][0]
    told(model, monkeypatch, example.targets)
    choices = model.choices(example)
    assert {u for c in choices for u in c.utterances} == {example.id}
    np.testing.assert_allclose(model.predict(example).mean[:, 0], example.targets[:, 0], atol=1e-4)
    assert model.report(example)["selection"][0] == {"phone": choices[0].phone, "used": choices[0].phone,
                                                      "from": {example.id: 1.0}}


def test_a_guide_that_is_made_anew_shows_the_face_that_was_given(
        model: GuidedCodebook, examples: dict[str, list[Example]], tmp_path: Path) -> None:
    opened, face = guided(), rig(3)
    opened.load_state(model.state())
    assert isinstance(opened.leader, PlainNetwork)
    opened.take_face(face)
    opened.shown_on(face)
    opened.fit(examples["train"], examples["val"], tmp_path)
    assert isinstance(opened.leader, NetworkModel) and opened.leader.face is face
    never_asked = guided()
    never_asked.shown_on(face)
    assert never_asked.leader.face is face


def test_the_guide_moves_as_much_as_the_talker(model: GuidedCodebook, examples: dict[str, list[Example]]) -> None:
    predicted = np.concatenate([model.leader.predict(e).mean[e.valid, 0] for e in examples["val"]])
    measured = np.concatenate([e.targets[e.valid, 0] for e in examples["val"]])
    stretched = (predicted - model.centre_) * model.stretch_ + model.centre_
    np.testing.assert_allclose(stretched.std(0), measured.std(0), rtol=1e-4)


def test_joins_count_as_much_as_their_weight(model: GuidedCodebook, examples: dict[str, list[Example]]) -> None:
    samples = model._samples.copy()
    rows = [(np.array([0]), np.zeros(1)), (np.array([1, 2]), np.array([0.0, 1.0])), (np.array([3]), np.zeros(1))]
    try:
        model._samples[:4] = 0
        model._samples[1] = 2.0  # near the guide, and 2 away from both neighbours in every parameter
        jumps = 2 * 4.0 * samples.shape[2]
        model.join = 1.0
        assert model._path(rows) == [0, 2, 3] and jumps > 1
        model.join = 0.0
        assert model._path(rows) == [0, 1, 3]
    finally:
        model._samples, model.join = samples, 0.03


def test_ramps_meet_in_the_middle_of_a_jump() -> None:
    static = np.concatenate([np.zeros((4, 1)), np.ones((4, 1))])
    out = _ramped(static, np.ones((1, 1)), np.array([4, 4]))[:, 0]
    np.testing.assert_allclose(out, [0, 0, 0.125, 0.375, 0.625, 0.875, 1, 1])


def test_examples_beside_the_path_are_those_that_cost_least_in_its_place(model: GuidedCodebook) -> None:
    row = (np.array([0, 1, 2, 3]), np.array([3.0, 1.0, 9.0, 2.0]))
    samples = model._samples.copy()
    try:
        model._samples[:5] = 0
        model._samples[1] = 9.0  # cheap, and far from both neighbours
        model.examples = 3
        assert model._cheapest(row, [4, 0, 4], 1).tolist() == [0, 3, 2]
        model.examples = 1
        assert model._cheapest(row, [4, 0, 4], 1).tolist() == [0]
    finally:
        model._samples, model.examples = samples, 3
    choice = model._choice(0, np.array([0, 1]))
    assert choice.weights == (0.5, 0.5) and sum(choice.described()["from"].values()) == 1


def test_unknown_phone_takes_its_neighbours_pieces(model: GuidedCodebook, examples: dict[str, list[Example]]) -> None:
    example = examples["test"][0]
    codes = example.codes.arrays["phone_code"].copy()
    spoken = set(np.unique(model.book.corpus_.code))
    missing = next(k for k in range(41) if k not in spoken)
    codes[len(codes) // 2] = missing
    changed = replace(example, codes=replace(example.codes, arrays={**example.codes.arrays, "phone_code": codes}))
    assert any(c.phone != c.used for c in model.choices(changed))


def test_any_system_can_lead(examples: dict[str, list[Example]], tmp_path: Path) -> None:
    led = guided(guide={"system": "cca", "context": 2, "cutoff": 4.0})
    led.fit(examples["train"], examples["val"], tmp_path)
    assert led.leader.settings.context == 2 and led.leader.system == "cca"
    again = guided(guide={"system": "cca", "context": 2, "cutoff": 4.0})
    again.load_state(led.state())
    example = examples["test"][0]
    np.testing.assert_array_equal(again.predict(example).mean, led.predict(example).mean)
    said = led.predict(example).mean[:, 0]
    assert np.corrcoef(said.ravel(), example.targets[:, 0].ravel())[0, 1] > 0.8
    assert guided(guide={"system": "network", "network": of_layers(8)}).leader.settings.fit is SETTINGS
    with pytest.raises(DnnvssError, match=r"model\.guide\.contxt is no setting.*model\.guide\.context"):
        guided(guide={"system": "cca", "contxt": 2})


def test_settings_out_of_range(tmp_path: Path) -> None:
    for wrong in ({"candidates": 0}, {"join": -1.0}, {"examples": 0}, {"candidates": 2}):
        with pytest.raises(DnnvssError, match=f"model.{next(iter(wrong))}="):
            guided(**wrong)
