"""A coefficient of a test sentence over time, measured and predicted by runs."""

from pathlib import Path

import numpy as np

from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.runs import read_run
from dnnvss.render.plots import plot_trajectories


def draw(folders: list[Path], out: Path, coefficient: int = 5, utterance: str | None = None) -> Path:
    """Write the plot and return its path.

    Args:
        folders: finished runs, tested on the same sentences.
        out: the picture.
        coefficient: counted from 1.
        utterance: a test sentence; the first one where None.

    Raises:
        DnnvssError: a run that is not finished, or a sentence or coefficient that they do not have.
    """
    runs = [read_run(folder) for folder in folders]
    chosen = utterance or next(iter(runs[0].arrays["reference"]))
    series: dict[str, np.ndarray] = {}
    for run in runs:
        if chosen not in run.arrays["predicted"]:
            raise DnnvssError("is no test sentence of the run", file=run.folder, utterance=chosen,
                              remedy=f"Choose one such as {next(iter(run.arrays['predicted']))}")
        reference, predicted = run.arrays["reference"][chosen], run.arrays["predicted"][chosen]
        if not 1 <= coefficient <= reference.shape[1]:
            raise DnnvssError(f"there is no coefficient {coefficient}", file=run.folder,
                              remedy=f"Choose one from 1 to {reference.shape[1]}")
        series.setdefault("reference", reference[:, coefficient - 1])
        name = run.settings.labels_name
        series[name if name not in series else run.folder.name] = predicted[:, coefficient - 1]
    spoken = Corpus.open(runs[0].corpus).utterances[chosen]
    title = f"coefficient {coefficient}, {chosen}: {spoken.text}"
    return plot_trajectories(out, series, runs[0].clock.rate, spoken.alignment["phones"], title)
