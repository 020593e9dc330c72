"""The end of a sweep: one table of all its runs, and one sentence by all of them side by side."""

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
        self.jobs: list[DictConfig] = []

    def on_job_end(self, config: DictConfig, job_return: Any, **kwargs: Any) -> None:
        """Remember a job that ended well."""
        if job_return.status.name == "COMPLETED":
            self.jobs.append(config)

    def on_multirun_end(self, config: DictConfig, **kwargs: Any) -> None:
        """Write ``evaluation.md``, ``.json`` and ``.html`` of all runs, and ``side_by_side.mp4``."""
        if len(self.jobs) < 2:
            return
        from dnnvss.evaluation.__main__ import main as evaluate

        first = self.jobs[0]
        folders = [run_folder(job) for job in self.jobs]
        out = Path(first.runs) / "-".join(p for p in (self.name, first.corpus.name, first.corpus.split) if p)
        if evaluate([*map(str, folders), "--out", str(out)]) == 0 and self.video:
            from dnnvss.pipeline.videos import write_systems

            corpus = Corpus.open(first.corpus.out)
            sentence = sorted(u.id for u in corpus.split("test", first.corpus.split))[0]
            print(f"wrote {write_systems([Run.open(f) for f in folders], corpus, sentence, out / 'side_by_side.mp4')}")


def run_folder(config: DictConfig) -> Path:
    """Return the run folder of a job's configuration, hydra's own settings left out."""
    config = OmegaConf.masked_copy(config, [str(k) for k in config if k != "hydra"])
    return Path(config.run or Path(config.runs) / run_name(config, Corpus.open(config.corpus.out).fingerprint))
