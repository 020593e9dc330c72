"""What a sweep notes of its jobs, and what it deletes: its own notes, wherever they are to lie."""

from pathlib import Path

import pytest
from omegaconf import OmegaConf

from dnnvss.commands.sweep import CompareRuns, NameFailures, Notes


@pytest.fixture(params=[NameFailures, lambda: CompareRuns("sweep")], ids=["failures", "comparison"])
def sweep(request: pytest.FixtureRequest) -> Notes:
    """A callback as hydra makes it."""
    return request.param()


def test_a_sweep_that_has_no_notes_deletes_nothing(sweep: Notes, tmp_path: Path,
                                                   monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "mine.txt").write_text("mine")
    monkeypatch.chdir(tmp_path)
    sweep.on_multirun_end(OmegaConf.create({}))
    assert (tmp_path / "data" / "mine.txt").read_text() == "mine"


def test_notes_lie_in_the_folder_of_the_sweep_which_is_made(sweep: Notes, tmp_path: Path) -> None:
    there = tmp_path / "sweeps" / "today"
    config = OmegaConf.create({"hydra": {"sweep": {"dir": str(there)}}})
    sweep.on_multirun_start(config)
    assert [path.name[:7] for path in there.iterdir()] == [".sweep-"]
    sweep.on_multirun_end(config)
    assert there.is_dir() and not list(there.iterdir())


def test_a_sweep_that_cannot_leave_notes_is_no_sweep(sweep: Notes, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(SystemExit, match=r"file.*hydra\.sweep\.dir"):
        sweep.on_multirun_start(OmegaConf.create({"hydra": {"sweep": {"dir": str(tmp_path / "file")}}}))
