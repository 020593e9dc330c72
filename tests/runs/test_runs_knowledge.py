"""Runs of other talkers as sources: found, refused where they do not fit, and named by what they hold."""

from pathlib import Path

import numpy as np
import pytest
import torch
from conftest import composed

from dnnvss import files
from dnnvss.commands.train_settings import run_settings
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.choice import AutoSettings
from dnnvss.runs.files import RunFiles
from dnnvss.runs.knowledge import source_files, with_knowledge
from dnnvss.runs.naming import run_name
from dnnvss.runs.settings import RunSettings
from dnnvss.runs.voice import Voice
from dnnvss.training.checkpoints import save_checkpoint


def configured(*given: str) -> RunSettings:
    return run_settings(composed("train", *given))


def run_of(folder: Path, *given: str, learnt: float = 1) -> Path:
    """A run folder as far as others learn from it."""
    configured("model=kernel", *given).write(files.make_folder(folder))
    save_checkpoint(RunFiles(folder).model, {"state": {"mean": torch.from_numpy(np.full(3, learnt))}})
    return folder


def test_candidates_that_learn_from_others_are_tried_where_there_are_some(tmp_path: Path) -> None:
    assert "adapted" not in AutoSettings.read(with_knowledge(configured()).model).candidates
    source = run_of(tmp_path / "a")
    auto = AutoSettings.read(with_knowledge(configured(f"knowledge={source}")).model)
    assert list(auto.candidates["adapted"]["sources"]) == ["demo"] and "sources" not in auto.candidates["kernel"]
    both = with_knowledge(configured("model=adapted", f"knowledge=[{source},{run_of(tmp_path / 'b')}]"))
    assert list(both.model["sources"]) == ["demo", "demo-2"]


def test_a_run_is_named_by_what_its_sources_hold_and_not_by_where_they_lie(tmp_path: Path) -> None:
    names = [run_name(with_knowledge(configured("model=adapted", f"knowledge={folder}")), "abc") for folder in (
        run_of(tmp_path / "a"), run_of(tmp_path / "b"), run_of(tmp_path / "c", learnt=2))]
    assert names[0] == names[1] != names[2]
    assert run_name(configured("model=kernel", f"knowledge={tmp_path / 'a'}"), "abc") == run_name(
        configured("model=kernel"), "abc")


@pytest.mark.parametrize("given, message", [
    (["labels=ph_a"], "was trained with labels=ph_class, and this run is to have labels=ph_a.*labels=ph_class"),
    (["trajectory.rate=50"], r"has a clock of 100 frames a second.*trajectory\.rate=100"),
    (["model=kernel"], "model=kernel learns nothing from other talkers")])
def test_what_cannot_be_learnt_from_is_refused(tmp_path: Path, given: list[str], message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        with_knowledge(configured(f"knowledge={run_of(tmp_path / 'a')}", *given))


def test_a_run_that_has_not_ended_is_no_source(tmp_path: Path) -> None:
    RunFiles(source := run_of(tmp_path / "a")).model.unlink()
    with pytest.raises(DnnvssError, match="holds a run that has not ended"):
        with_knowledge(configured(f"knowledge={source}"))
    with pytest.raises(DnnvssError, match="no such file"):
        with_knowledge(configured("knowledge=nowhere"))


def test_phones_are_borrowed_and_said_to_be() -> None:
    own, other = (Voice(phones, ("sil",), "en_us", "25", "", frozenset({"a"})) for phones in (("AA", "B"), ("AA", "P")))
    both = own.borrowing(other)
    assert both.phones == ("AA", "B", "P") and both.borrowed == ("P",) and both.borrowing(other) == both
    assert both.triphones == own.triphones and own.borrowing(own) == own


def test_the_files_of_a_source_lie_beside_what_it_learnt(tmp_path: Path) -> None:
    found = source_files(with_knowledge(configured("model=adapted", f"knowledge={run_of(tmp_path / 'a')}")))
    assert [places.folder for places in found] == [tmp_path / "a"] and source_files(configured()) == []
