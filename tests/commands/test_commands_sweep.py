"""What a sweep notes of its jobs, and what it deletes: its own notes, wherever they are to lie; what makes it fail."""

import math
import pickle
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from omegaconf import OmegaConf

from dnnvss.commands import sweep as module
from dnnvss.commands.sweep import CompareRuns, Failed, NameFailures, Notes, sweepable
from dnnvss.errors import DnnvssError


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


def ended(sweep: Notes, there: Path, *values: float) -> None:
    """A multirun of jobs that returned these, each noted as hydra does; the notes of its end are left to the caller."""
    for number, value in enumerate(values):
        config = OmegaConf.create({"hydra": {"job": {"num": number}, "sweep": {"dir": str(there)}}, "seed": number,
                                   "runs": str(there)})
        if not number:
            sweep.on_multirun_start(config)
        job: Any = SimpleNamespace(status=SimpleNamespace(name="COMPLETED"), return_value=value,
                                   overrides=[f"seed={number}"])
        sweep.on_job_end(config, pickle.loads(pickle.dumps(job)))  # a launcher may run it in another process


def test_a_finished_run_that_is_worth_no_number_did_not_fail(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                                             capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(module, "HydraConfig", SimpleNamespace(
        initialized=lambda: True, get=lambda: SimpleNamespace(mode=module.RunMode.MULTIRUN)))

    @sweepable
    def job(config: Any) -> float:
        if config:
            raise DnnvssError("no corpus")
        return math.nan

    nothing_moved, failed = job(None), job({"a": 1})
    assert math.isnan(nothing_moved) and math.isnan(failed)
    names, compared = NameFailures(), CompareRuns("c")
    for sweep in (names, compared):
        ended(sweep, tmp_path, nothing_moved, failed)
    assert [job["given"] for job in compared.taken()] == [["seed=0"]]
    with pytest.raises(SystemExit):
        names.on_multirun_end(OmegaConf.create({}))
    assert "1 run(s) of the sweep failed: seed=1" in capsys.readouterr().err


@pytest.mark.parametrize("error", [DnnvssError("no words"), MemoryError(), OSError(28, "No space left on device"),
                                   KeyError("ours"), KeyboardInterrupt()], ids=lambda error: type(error).__name__)
def test_a_run_that_fails_for_any_reason_does_not_end_the_others(
        error: BaseException, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(module, "HydraConfig", SimpleNamespace(
        initialized=lambda: True, get=lambda: SimpleNamespace(mode=module.RunMode.MULTIRUN)))

    @sweepable
    def job(config: Any) -> float:
        raise error

    if isinstance(error, KeyboardInterrupt):
        with pytest.raises(SystemExit, match="130"):
            job(OmegaConf.create())
        return
    assert isinstance(job(OmegaConf.create()), Failed)
    *reason, last = capsys.readouterr().err.splitlines()
    assert last == "the sweep goes on without this run"
    assert reason[-1] == "KeyError: 'ours'" if isinstance(error, KeyError) else len(reason) == 1


@pytest.mark.parametrize("error", [DnnvssError("other sentences"), OSError(28, "No space left on device"), KeyError(3)])
def test_a_comparison_that_fails_lets_the_sweep_fail_behind_the_names_of_failed_runs(
        error: Exception, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def trained(config: Any, given: Any) -> Any:
        raise error

    monkeypatch.setattr(module, "trained", trained)
    names, compared = NameFailures(), CompareRuns("c")
    for sweep in (names, compared):
        ended(sweep, tmp_path, 0.5, 0.6, Failed(math.nan))
    for sweep in (compared, names):  # hydra's order at the end
        if sweep is compared:
            sweep.on_multirun_end(OmegaConf.create({}))
            continue
        with pytest.raises(SystemExit) as exit_:
            sweep.on_multirun_end(OmegaConf.create({}))
        assert exit_.value.code == 1
    told = capsys.readouterr().err
    assert type(error).__name__ in told or "error: " in told.splitlines()[0]
    assert told.splitlines()[-2:] == [
        "error: 1 run(s) of the sweep failed: seed=2",
        "error: the runs of the sweep are there, and their comparison is not whole"]
    assert not Notes.undone  # another sweep of the process starts anew


def test_runs_of_another_split_are_compared_by_themselves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compared = CompareRuns("c")
    monkeypatch.setattr(module, "trained", lambda config, given: {
        "ann": SimpleNamespace(split="unseen" if config["seed"] % 2 else "")})
    told: list[list[str]] = []
    monkeypatch.setattr(compared, "_compare", lambda runs, where: told.append(list(runs)))
    ended(compared, tmp_path, 0.5, 0.6, 0.7, 0.8)
    compared.on_multirun_end(OmegaConf.create({}))
    assert told == [["seed=0", "seed=2"], ["seed=1", "seed=3"]]
