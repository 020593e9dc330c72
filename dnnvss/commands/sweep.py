"""Sweeps: a run that fails does not end the others; at the end one table of all, and a sentence by all side by side."""

import functools
import math
import shutil
import sys
import tempfile
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

from hydra.core.hydra_config import HydraConfig
from hydra.experimental.callback import Callback
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf

from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.commands.several import several_corpora
from dnnvss.commands.train_settings import run_settings
from dnnvss.commands.train_together import planned
from dnnvss.commands.usage import INTERRUPTED, guarded
from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.choice import settled
from dnnvss.runs import naming
from dnnvss.runs.run import Run
from dnnvss.runs.settings import RunSettings
from dnnvss.staging import abandoned, held


class Failed(float):
    """What a job of a sweep that failed returns in place of what its run was worth: NaN, which that may be too."""


def sweepable(function: Callable[[DictConfig], float]) -> Callable[[DictConfig], float]:
    """Return a job that, as part of a sweep, says what went wrong and returns that it failed: the others are run."""

    @functools.wraps(function)
    def wrapped(config: DictConfig) -> float:
        if not HydraConfig.initialized() or HydraConfig.get().mode != RunMode.MULTIRUN:
            return function(config)
        worth: float = _outcome(function, config)
        if isinstance(worth, Failed):
            print("the sweep goes on without this run", file=sys.stderr)
        return worth

    return wrapped


def _outcome(step: Callable[..., Any], *given: Any) -> Any:
    """What a step returns; where it fails, whatever the reason, that is told, and it returns that it failed.

    Raises:
        SystemExit: Ctrl-C, which ends the sweep.
    """
    try:
        return guarded(step)(*given)
    except SystemExit as ended:  # the reason has been told
        if ended.code == INTERRUPTED:
            raise
    except Exception:
        traceback.print_exc()
    return Failed(math.nan)


class Notes(Callback):
    """A callback of hydra that notes jobs in a hidden folder of ``hydra.sweep.dir``, the working directory by default.

    A launcher may run jobs in other processes or on other machines, each with a copy of the callback; the launching
    process reads what they leave. Without a multirun there is no folder (None).
    """

    undone: ClassVar[list[str]] = []
    """What a callback of the launching process could not do at the end. Of an error hydra would make a warning, and of
    an exit the end of the callbacks behind it."""

    def __init__(self) -> None:
        self.notes: Path | None = None

    def on_multirun_start(self, config: DictConfig, **kwargs: Any) -> None:
        """Make the folder of notes; copies of the callback take its path with them.

        Raises:
            SystemExit: it cannot be made. Of any other error hydra would make a warning, and train without notes.
        """
        where = Path(OmegaConf.select(config, "hydra.sweep.dir", default=".")).absolute()
        try:
            where.mkdir(parents=True, exist_ok=True)
            for left in where.glob(".sweep-*"):  # of sweeps that were killed
                if left.is_dir() and abandoned(left):
                    shutil.rmtree(left, ignore_errors=True)
            self.notes = Path(tempfile.mkdtemp(prefix=".sweep-", dir=where))
            held(self.notes)  # until this process ends
        except OSError as error:
            problem = f"a sweep cannot leave its notes there ({error.strerror or error})"
            sys.exit(f"error: {DnnvssError(problem, file=where, remedy='Give another folder as hydra.sweep.dir')}")

    def note(self, config: DictConfig, job_return: Any) -> None:
        """Note what a job of a multirun was given, and its configuration."""
        if self.notes is None:
            return
        number = OmegaConf.select(config, "hydra.job.num", default=len(list(self.notes.iterdir())))
        job = {"given": list(job_return.overrides or ()), "config": OmegaConf.to_container(_own(config))}
        files.write_json(self.notes / f"{number:04d}.json", job)

    def taken(self) -> list[dict[str, Any]]:
        """Return the notes in the order of the jobs, and delete them."""
        if self.notes is None:
            return []
        jobs = [files.read_json(note) for note in sorted(self.notes.glob("*.json"))]
        shutil.rmtree(self.notes)
        return jobs


def _ended_well(job_return: Any) -> bool:
    return job_return.status.name == "COMPLETED" and not isinstance(job_return.return_value, Failed)


class NameFailures(Notes):
    """Says at the end of a multirun which jobs failed, and lets the command fail, also where another callback did. The
    first of the callbacks: it ends the process after the others have done their work."""

    def on_job_end(self, config: DictConfig, job_return: Any, **kwargs: Any) -> None:
        """Note a job that failed."""
        if not _ended_well(job_return):
            self.note(config, job_return)

    def on_multirun_end(self, config: DictConfig, **kwargs: Any) -> None:
        """Name the jobs that failed, and what else did."""
        failed = self.taken()
        if failed:
            names = "; ".join(" ".join(g.lstrip("+") for g in job["given"]) or "the only one" for job in failed)
            print(f"error: {len(failed)} run(s) of the sweep failed: {names}", file=sys.stderr)
        for what in self.undone:
            print(f"error: {what}", file=sys.stderr)
        if failed or self.undone:
            self.undone.clear()
            sys.exit(1)


class CompareRuns(Notes):
    """A callback of hydra that compares the runs of a multirun when the last one has ended.

    Args:
        name: of the folder of the comparison, ``<runs>/<name>-<corpus>[-<split>]``.
        video: whether to render the first test sentence that none of them has learnt from by all systems.
        sizes: whether to draw a heat map over layers and width.
    """

    def __init__(self, name: str, video: bool = True, sizes: bool = False) -> None:
        super().__init__()
        self.name, self.video, self.sizes = name, video, sizes

    def on_job_end(self, config: DictConfig, job_return: Any, **kwargs: Any) -> None:
        """Note a job of a multirun that ended well, and what it was given."""
        if _ended_well(job_return):
            self.note(config, job_return)

    def on_multirun_end(self, config: DictConfig, **kwargs: Any) -> None:
        """Write ``evaluation.md``, ``.json`` and ``.html`` of all runs of a talker and split, and what is asked."""
        if isinstance(_outcome(self._compare_all), Failed):
            self.undone.append("the runs of the sweep are there, and their comparison is not whole")

    def _compare_all(self) -> None:
        jobs = self.taken()
        if len(jobs) < 2:
            return
        alike: dict[tuple[str, str], dict[str, RunSettings]] = {}
        for name, job in zip(what_differs([tuple(job["given"]) for job in jobs]), jobs, strict=True):
            for talker, own in trained(OmegaConf.create(job["config"]), job["given"]).items():
                alike.setdefault((talker, own.split), {})[name] = own
        for told in alike.values():
            if len(told) > 1:
                self._compare(told, Path(jobs[0]["config"]["runs"]))

    def _compare(self, told: Mapping[str, RunSettings], where: Path) -> None:
        from dnnvss.evaluation.finished import compare_runs

        names, settings, folders = list(told), list(told.values()), [Path(str(own.run)) for own in told.values()]
        corpus = str(settings[0].corpus["name"])
        out = _free(where / "-".join(p for p in (self.name, corpus, settings[0].split) if p), [f.name for f in folders])
        made = compare_runs(folders, out, names)
        print(f"{made.table}\nwrote {made.page}")
        if self.sizes:
            from dnnvss.evaluation.sizes import write_sizes

            print("wrote " + ", ".join(map(str, write_sizes(folders, settings, out))))
        if self.video:
            from dnnvss.evaluation.runs import not_learnt
            from dnnvss.evaluation.videos import write_systems

            opened = Corpus.open(settings[0].corpus_folder)
            runs = dict(zip(names, map(Run.open, folders), strict=True))
            kept = [set(not_learnt(read_arrays(run.files.prediction("reference")), opened, run.settings.split))
                    for run in runs.values()]
            if shown := sorted(set.intersection(*kept)):
                print(f"wrote {write_systems(runs, opened, shown[0], out / 'side_by_side.mp4')}")
            else:
                print("no video side by side: there is no test sentence that none of the runs has learnt from (folds=0 "
                      "keeps a test split)")


def _free(folder: Path, runs: list[str]) -> Path:
    """Return the folder of a comparison, with a number behind its name where that holds one of other runs.

    The runs compared are noted in ``sweep.json``.
    """
    number, place = 1, folder
    while (place / "sweep.json").is_file() and files.read_json(place / "sweep.json") != runs:
        number += 1
        place = folder.with_name(f"{folder.name}-{number}")
    files.write_json(place / "sweep.json", runs)
    return place


def what_differs(given: Sequence[tuple[str, ...]]) -> list[str]:
    """Return a name for each job: what it was given and not all were, such as ``model=hsmm``, or its number."""
    shared = set(given[0]).intersection(*given)
    names = [" ".join(g.lstrip("+") for g in own if g not in shared) for own in given]
    return names if len(set(names)) == len(names) else [str(k + 1) for k in range(len(given))]


def trained(config: DictConfig, given: Sequence[str]) -> dict[str, RunSettings]:
    """The runs of a job, by talker: their settings, of which ``run`` says where they lie.

    Args:
        config: what the job was composed to.
        given: its overrides.
    """
    if (corpora := several_corpora(config)) is not None:
        training = planned(corpora, given)
        return {name: replace(training.settings[name], run=str(folder)) for name, folder in training.folders.items()}
    settings = run_settings(config)
    return {str(settings.corpus["name"]): replace(settings, run=str(run_folder(config)))}


def run_folder(config: DictConfig) -> Path:
    """Return the run folder of a job's configuration, hydra's own settings left out."""
    settings = run_settings(config)
    corpus = Corpus.open(settings.corpus_folder)
    return naming.run_folder(settled(settings, corpus)[0], corpus.fingerprint)


def _own(config: DictConfig) -> DictConfig:
    return OmegaConf.masked_copy(config, [str(k) for k in config if k != "hydra"])
