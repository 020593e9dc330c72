"""Which run speaks where none is named: the best of those that do with what is given."""

import os
from pathlib import Path

import pytest
from conftest import composed

from dnnvss import files
from dnnvss.commands.train_settings import run_settings
from dnnvss.errors import DnnvssError
from dnnvss.runs.choice import HEARD, SPOKEN, best_run, finished_runs
from dnnvss.runs.files import RunFiles


def finished(runs: Path, name: str, headline: float, age: int, *given: str, corpus: str = "c",
             tested: tuple[str, ...] = ("a", "b"), test: float | None = 0.5) -> Path:
    """A folder that looks like a finished run that ended ``age`` seconds ago, worth ``headline`` in validation."""
    settings = run_settings(composed("train", "model=feedforward", *given))
    places = RunFiles(files.make_folder(runs / name))
    settings.write(places.folder)
    files.write_json(places.provenance, {"dnnvss": "", "corpus": corpus})
    files.write_json(places.metrics, {"headline": test, "validation": {"headline": headline, "sentences": tested}})
    os.utime(places.metrics, (1e9 - age, 1e9 - age))
    return places.folder


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    finished(tmp_path, "phones", 0.8, 1)
    finished(tmp_path, "better", 0.9, 5, "labels=ph_dv")
    finished(tmp_path, "sound", 0.7, 2, "labels=mel")
    finished(tmp_path, "both", 0.85, 3, "labels=ph_mel")
    finished(tmp_path, "elsewhere", 0.99, 4, corpus="other")
    finished(tmp_path, "points", 0.98, 4, "face=points")
    files.write_text(files.make_folder(tmp_path / "broken") / "metrics.json", "{}")
    return tmp_path


@pytest.mark.parametrize("given, name, why", [
    (SPOKEN | HEARD, "better", "labels=ph_dv model=feedforward, correlation 0.900 in validation: the best of 4"),
    (SPOKEN, "better", "the best of 2 runs on its corpus"),
    (HEARD, "sound", "model=feedforward, correlation 0.700 in validation: the last run that needs no text")])
def test_the_best_run_of_the_last_corpus_that_does_with_what_is_given(
        runs: Path, given: frozenset[str], name: str, why: str) -> None:
    folder, told = best_run(runs, given)
    assert folder.name == name and why in told


def test_a_system_that_looks_at_phones_needs_them_whatever_its_labels(tmp_path: Path) -> None:
    finished(tmp_path, "guided", 0.9, 1, "labels=mel", "model=guided")
    with pytest.raises(DnnvssError, match=r"can follow a voice alone: labels=mel model=guided needs phones\. .*text="):
        best_run(tmp_path, HEARD)
    assert best_run(tmp_path, SPOKEN | HEARD) == (tmp_path / "guided", "")


def test_no_run_is_told(tmp_path: Path) -> None:
    with pytest.raises(DnnvssError, match="no finished run here"):
        best_run(tmp_path, SPOKEN)
    files.write_text(files.make_folder(tmp_path / "broken") / "metrics.json", "{}")
    with pytest.raises(DnnvssError, match=r"config\.yaml"):
        best_run(tmp_path, SPOKEN)


def test_a_talker_is_chosen_by_name(tmp_path: Path) -> None:
    finished(tmp_path, "ann", 0.8, 5, "corpus=folder", "corpus.name=ann", "corpus.raw=none", corpus="a")
    finished(tmp_path, "bob", 0.9, 1, "corpus=folder", "corpus.name=bob", "corpus.raw=none", corpus="b")
    assert best_run(tmp_path, SPOKEN)[0].name == "bob" and best_run(tmp_path, SPOKEN, "ann")[0].name == "ann"
    with pytest.raises(DnnvssError, match=r"no finished run here is of talker=eve.*ann, bob"):
        best_run(tmp_path, SPOKEN, "eve")


@pytest.mark.parametrize("lags, name", [(0.004, "hardened"), (0.006, "sound")])
def test_of_runs_alike_the_one_trained_in_noise_listens(tmp_path: Path, lags: float, name: str) -> None:
    finished(tmp_path, "sound", 0.9, 1, "labels=mel")
    finished(tmp_path, "hardened", 0.9 - lags, 2, "labels=mel", "trainer.altered=3")
    folder, told = best_run(tmp_path, HEARD)
    assert folder.name == name and ("trained in noise too" in told) == (name == "hardened")


@pytest.mark.parametrize("given, tested", [(["aam.modes=8"], ("a", "b")), ([], ("a", "b", "c"))])
def test_headlines_of_other_coefficients_or_sentences_are_not_compared(
        tmp_path: Path, given: list[str], tested: tuple[str, ...]) -> None:
    finished(tmp_path, "last", 0.8, 1)
    finished(tmp_path, "other", 0.9, 2, *given, tested=tested)
    assert best_run(tmp_path, SPOKEN)[0].name == "last"
    finished(tmp_path, "same", 0.85, 3, tested=("b", "a"))
    assert best_run(tmp_path, SPOKEN)[0].name == "same"


def test_what_is_no_network_is_not_trained_in_noise_whatever_is_asked(tmp_path: Path) -> None:
    finished(tmp_path, "network", 0.899, 1, "labels=mel", "trainer.altered=3")
    finished(tmp_path, "linear", 0.9, 2, "labels=mel", "model=cca", "trainer.altered=3")
    folder, told = best_run(tmp_path, HEARD)
    assert folder.name == "network" and "trained in noise too" in told


def test_phones_need_no_noise_in_training(tmp_path: Path) -> None:
    finished(tmp_path, "both", 0.9, 1, "labels=ph_mel")
    finished(tmp_path, "phones", 0.897, 2)
    folder, told = best_run(tmp_path, SPOKEN | HEARD)
    assert folder.name == "phones" and "noise" not in told


def test_the_test_split_chooses_nothing(tmp_path: Path) -> None:
    finished(tmp_path, "tests_well", 0.8, 1, test=0.99)
    finished(tmp_path, "better", 0.81, 2, test=0.1)
    finished(tmp_path, "nothing_moved", 0.82, 3, test=None)
    assert best_run(tmp_path, SPOKEN)[0].name == "nothing_moved"
    assert [c.headlines.validation for c in finished_runs(tmp_path)] == [0.8, 0.81, 0.82]


def test_runs_without_a_validation_headline_are_not_compared(tmp_path: Path) -> None:
    for name, age in (("new", 1), ("as_good", 2), ("old", 3)):
        finished(tmp_path, name, {"new": 0.8, "as_good": 0.9, "old": 0.95}[name], age, test=0.9)
    files.write_json(tmp_path / "old" / "metrics.json", {"headline": 0.99})
    os.utime(tmp_path / "old" / "metrics.json", (1e9 - 3, 1e9 - 3))
    assert best_run(tmp_path, SPOKEN)[0].name == "as_good"
    os.utime(tmp_path / "old" / "metrics.json", (1e9, 1e9))
    folder, told = best_run(tmp_path, SPOKEN)
    assert folder.name == "old" and "the last run; it keeps no correlation on the validation split" in told


@pytest.mark.parametrize("metrics, told", [
    ({}, "headline is missing"), ({"headline": "high"}, "headline is"),
    ({"headline": 0.5, "validation": 3}, "validation"),
    ({"headline": 0.5, "validation": {"headline": True, "sentences": []}}, "validation: headline")])
def test_damaged_metrics_are_named(tmp_path: Path, metrics: dict[str, object], told: str) -> None:
    finished(tmp_path, "run", 0.8, 1)
    files.write_json(tmp_path / "run" / "metrics.json", metrics)
    with pytest.raises(DnnvssError, match=rf"metrics\.json.*{told}|{told}"):
        best_run(tmp_path, SPOKEN)
