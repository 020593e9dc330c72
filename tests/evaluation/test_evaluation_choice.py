"""The system that suits the footage: chosen by size and by trials, kept, and the same when it is chosen again."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import CLOCK, TABLE, composed, make_example
from face.face_cases import LinearFace, rig
from omegaconf import OmegaConf

from dnnvss.commands.train_settings import run_settings
from dnnvss.curves import STATIC_DELTA_DELTA2
from dnnvss.errors import DnnvssError
from dnnvss.evaluation import choice as choosing
from dnnvss.evaluation.choice import AutoSettings, choose, cross_predicted, settled, tried
from dnnvss.runs.fitting import Material, _folds
from dnnvss.runs.folds import fewest_folds, fold_count, folded
from dnnvss.runs.naming import run_name
from dnnvss.runs.settings import RunSettings
from dnnvss.systems import Example
from dnnvss.systems.examples import Task, speech_frames
from dnnvss.systems.phone_mean import PhoneMean

TASK = Task(TABLE, CLOCK, STATIC_DELTA_DELTA2)


def configured(*given: str) -> RunSettings:
    return run_settings(composed("train", "labels=ph_d", *given))


def auto(**changes: object) -> AutoSettings:
    return replace(AutoSettings.read(configured().model), **changes)  # type: ignore[arg-type]


def material(examples: dict[str, list[Example]], *given: str) -> Material:
    settings = configured(*given)
    corpus = SimpleNamespace(fingerprint="abc")
    return Material(settings, corpus, SimpleNamespace(face=rig(3)), examples)  # type: ignore[arg-type]


def test_every_sentence_is_said_by_a_system_that_has_not_heard_it(examples: dict[str, list[Example]]) -> None:
    heard: list[set[str]] = []

    class Spy(PhoneMean):
        def fit(self, train, val, folder):  # type: ignore[no-untyped-def]
            heard.append({e.id for e in (*train, *val)})
            super().fit(train, val, folder)

    train = examples["train"]
    said = cross_predicted(lambda: Spy(TABLE, CLOCK), TASK, train, 4)
    assert said.keys() == {e.id for e in train} and [len(ids) for ids in heard] == [6, 6, 6, 6]
    parts = folded(train, 4)
    for part, ids in zip(parts, heard, strict=True):
        assert not ids & {e.id for e in part["test"]} and len(part["val"]) == 1
    assert sorted(e.id for p in parts for e in p["test"]) == sorted(e.id for e in train)
    assert [e.id for p in folded(train[::-1], 4) for e in p["test"]] == [e.id for p in parts for e in p["test"]]


def test_the_best_is_chosen_and_kept(examples: dict[str, list[Example]], tmp_path: Path,
                                     monkeypatch: pytest.MonkeyPatch) -> None:
    able = ["phone_mean", "codebook", "kernel"]
    first = tried(material(examples), auto(folds=4), able, tmp_path)
    best = max(first.trials.values(), key=lambda t: t.correlation)
    assert first.trials[first.system].correlation >= best.correlation - 0.002
    assert f"{first.trials[first.system].correlation:.3f} (next " in first.reason
    assert list(first.trials) == able and "model=auto takes" in first.text

    def never(*_: object) -> None:
        raise AssertionError("tried again")

    monkeypatch.setattr(choosing, "trial", never)
    assert tried(material(examples), auto(folds=4), able, tmp_path) == first
    quiet = material(examples, "trainer.progress=false", "jobs=2", "runs=elsewhere")
    assert tried(quiet, replace(AutoSettings.read(quiet.settings.model), folds=4), able, tmp_path) == first
    with pytest.raises(AssertionError, match="tried again"):  # others have their own
        tried(material(examples, "seed=1"), auto(folds=4), able, tmp_path)


class Curves(LinearFace):
    """Seven curves without points, the last of which stands still below a movement of 3."""

    @property
    def least(self) -> np.ndarray:
        return np.array([0.0] * 6 + [3.0])


def test_a_trial_looks_at_all_curves_that_move() -> None:
    """Curves of a rig have no order: their mean runs over all of them, not over the first five."""
    rng = np.random.default_rng(5)
    train = [make_example(f"c{i}", rng, 7) for i in range(4)]
    for e in train:
        e.measured[0][:, :, 6] *= 0.1
    face = Curves(np.zeros((0, 2)), np.zeros((7, 0, 2)))
    found = choosing.trial(TASK, {"system": "phone_mean"}, "phone_mean", train, 4, face)
    said = cross_predicted(lambda: PhoneMean(TABLE, CLOCK), TASK, train, 4)
    spoken = {e.id: speech_frames(e.alignment, CLOCK) for e in train}
    told = [[np.corrcoef(e.measured[0][spoken[e.id], 0, d], said[e.id][spoken[e.id], d])[0, 1] for d in range(6)]
            for e in train]
    assert found.correlation == pytest.approx(np.mean(told), abs=1e-6)


def test_trials_in_other_parts_are_others(examples: dict[str, list[Example]], tmp_path: Path,
                                          monkeypatch: pytest.MonkeyPatch) -> None:
    """Where networks are to be tried, all are tried in three parts: those of five are not compared with them."""
    parts: list[int] = []

    def spied(task, mapping, name, train, folds, face):  # type: ignore[no-untyped-def]
        parts.append(folds)
        return choosing.Trial(0.5, 1.0, 0.0)

    monkeypatch.setattr(choosing, "trial", spied)
    for networks in (60.0, 0.0, 60.0):
        tried(material(examples), auto(networks=networks), ["phone_mean"], tmp_path)
    assert parts == [5, 3]


def test_a_trial_that_was_killed_costs_only_itself(examples: dict[str, list[Example]], tmp_path: Path,
                                                   monkeypatch: pytest.MonkeyPatch) -> None:
    real, seen = choosing.trial, []

    def spied(task, mapping, name, *given):  # type: ignore[no-untyped-def]
        seen.append(name)
        if len(seen) == 2:
            raise KeyboardInterrupt
        return real(task, mapping, name, *given)

    monkeypatch.setattr(choosing, "trial", spied)
    with pytest.raises(KeyboardInterrupt):
        tried(material(examples), auto(folds=2), ["phone_mean", "codebook"], tmp_path)
    tried(material(examples), auto(folds=2), ["phone_mean", "codebook"], tmp_path)
    assert seen == ["phone_mean", "codebook", "codebook"]


def test_much_speech_is_decided_by_its_size(examples: dict[str, list[Example]]) -> None:
    sentences = [SimpleNamespace(alignment=e.alignment) for e in examples["train"]]
    corpus = SimpleNamespace(split=lambda *_: sentences, fingerprint="abc")
    found = choose(configured(), auto(enough=0), corpus)  # type: ignore[arg-type]
    assert found.system == "feedforward" and not found.trials and "enough for a network" in found.reason
    settings, choice = settled(configured("model.enough=0"), corpus)  # type: ignore[arg-type]
    assert choice == replace(found, reason=choice.reason) if choice else False
    named = configured("model=feedforward")
    assert run_name(settings, "abc") == run_name(named, "abc")
    again, _ = settled(configured("model.enough=0"), corpus)  # type: ignore[arg-type]
    assert run_name(again, "abc") == run_name(settings, "abc") and "-feedforward-" in run_name(settings, "abc")
    assert settled(named, corpus) == (named, None)  # type: ignore[arg-type]


def test_what_was_chosen_is_the_run_of_that_name() -> None:
    chosen = replace(configured(), model=auto().candidates["ensemble"])
    assert run_name(chosen, "abc") == run_name(configured("model=ensemble"), "abc")
    assert OmegaConf.create(dict(chosen.model)) == OmegaConf.create(dict(configured("model=ensemble").model))


def test_a_large_one_that_is_no_candidate_is_refused() -> None:
    with pytest.raises(DnnvssError, match=r"model\.large=gaussian is none of the candidates"):
        configured("model.large=gaussian")


@pytest.mark.parametrize("count", range(3, 11))
def test_whatever_is_left_out_others_are_left_to_train_and_to_validate(
        examples: dict[str, list[Example]], count: int) -> None:
    some = [e for part in examples.values() for e in part][:count]
    for folds in range(fewest_folds(count), count + 1):
        assert all(part["train"] and part["val"] and part["test"] for part in folded(some, folds)), folds
    short = [*folded(some, fewest_folds(count) - 1)] if fewest_folds(count) > 2 else []
    assert all(not part["train"] for part in short[:1])  # fewer would not do


def test_three_sentences_are_tried_in_three_parts(examples: dict[str, list[Example]], tmp_path: Path) -> None:
    three = material({"train": examples["train"][:3]})
    found = tried(three, auto(folds=2), ["phone_mean", "codebook"], tmp_path)
    assert set(found.trials) == {"phone_mean", "codebook"}


@pytest.mark.parametrize("folds", [1, 2, 4])
def test_parts_that_leave_nothing_are_refused(examples: dict[str, list[Example]], folds: int) -> None:
    splits = dict(zip(("train", "val", "test"), ([e] for e in examples["train"]), strict=False))
    with pytest.raises(DnnvssError, match=f"folds={folds} leaves nothing.*Give folds=3 to 3"):
        _folds(configured(f"folds={folds}"), splits)
    assert _folds(configured("folds=3"), splits) == 3


def test_small_corpora_are_left_out_in_parts_and_fair_test_splits_are_kept(examples: dict[str, list[Example]]) -> None:
    assert fold_count(examples) == 10  # twelve sentences
    many = [*examples["train"], *examples["val"], *examples["test"]]
    assert fold_count({**examples, "test": many[:8]}) == 0
    assert fold_count({**examples, "train": many * 2}) == 5
    assert fold_count({"train": many[:1], "val": many[1:2], "test": many[2:3]}) == 3
    assert np.all([len(p["test"]) for p in folded(many, 5)])
