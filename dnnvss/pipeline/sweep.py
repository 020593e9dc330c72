"""The end of a sweep: one table of all its runs, and one sentence by all of them side by side."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hydra.experimental.callback import Callback
from omegaconf import DictConfig, OmegaConf

from dnnvss.corpus import Corpus
from dnnvss.pipeline.folder import Run, run_name


class CompareRuns(Callback):
    """A callback of hydra that compares the runs of a multirun when the last one has ended.

    Args:
        name: of the folder of the comparison, ``<runs>/<name>-<corpus>[-<split>]``.
        video: whether to render the first test sentence by all systems.
    """

    def __init__(self, name: str, video: bool = True) -> None:
        self.name, self.video = name, video
        self.jobs: list[tuple[DictConfig, tuple[str, ...]]] = []

    def on_job_end(self, config: DictConfig, job_return: Any, **kwargs: Any) -> None:
        """Remember a job that ended well, and what it was given."""
        if job_return.status.name == "COMPLETED":
            self.jobs.append((config, tuple(job_return.overrides or ())))

    def on_multirun_end(self, config: DictConfig, **kwargs: Any) -> None:
        """Write ``evaluation.md``, ``.json`` and ``.html`` of all runs, and ``side_by_side.mp4``."""
        if len(self.jobs) < 2:
            return
        from dnnvss.evaluation.__main__ import compare_runs

        first = self.jobs[0][0]
        folders = [run_folder(job) for job, _ in self.jobs]
        names = what_differs([given for _, given in self.jobs])
        out = Path(first.runs) / "-".join(p for p in (self.name, first.corpus.name, first.corpus.split) if p)
        print(f"wrote {compare_runs(folders, out, names)}")
        if self.video:
            from dnnvss.pipeline.videos import write_systems

            corpus = Corpus.open(first.corpus.out)
            sentence = sorted(u.id for u in corpus.split("test", first.corpus.split))[0]
            runs = dict(zip(names, map(Run.open, folders), strict=True))
            print(f"wrote {write_systems(runs, corpus, sentence, out / 'side_by_side.mp4')}")


def what_differs(given: Sequence[tuple[str, ...]]) -> list[str]:
    """Return a name for each job: what it was given and not all were, such as ``model=hsmm``, or its number."""
    shared = set(given[0]).intersection(*given)
    names = [" ".join(g for g in own if g not in shared) for own in given]
    return names if len(set(names)) == len(names) else [str(k + 1) for k in range(len(given))]


def run_folder(config: DictConfig) -> Path:
    """Return the run folder of a job's configuration, hydra's own settings left out."""
    config = OmegaConf.masked_copy(config, [str(k) for k in config if k != "hydra"])
    return Path(config.run or Path(config.runs) / run_name(config, Corpus.open(config.corpus.out).fingerprint))
