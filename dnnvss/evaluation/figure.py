"""Coefficients of a test sentence over time, measured and predicted by runs."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.evaluation.runs import RunData, open_corpus, read_run
from dnnvss.face.kinds import load_face
from dnnvss.render.plots import plot_panels
from dnnvss.runs.files import RunFiles


def draw(folders: list[Path], out: Path, coefficients: Sequence[str] = ("5",), utterance: str | None = None) -> Path:
    """Write the plot, coefficients below each other, and return its path.

    Args:
        folders: finished runs, tested on the same sentences.
        out: the picture.
        coefficients: each by its name, such as ``shape01``, or its number, counted from 1.
        utterance: a test sentence; the first one where None.

    Raises:
        DnnvssError: a run that is not finished, or a sentence or coefficient that they do not have.
    """
    runs = [read_run(folder) for folder in folders]
    chosen = utterance or next(iter(runs[0].arrays["reference"]))
    for run in runs:
        if chosen not in run.arrays["predicted"]:
            raise DnnvssError("is no test sentence of the run", file=run.folder, utterance=chosen,
                              remedy=f"Choose one such as {next(iter(run.arrays['predicted']))}")
    panels = {_label(c): _series(runs, chosen, c) for c in coefficients}
    spoken = open_corpus(runs[0].folder, runs[0].corpus).utterances[chosen]
    title = f"{next(iter(panels))}, {chosen}: {spoken.text}" if len(panels) == 1 else f"{chosen}: {spoken.text}"
    return plot_panels(out, panels, runs[0].clock.rate, spoken.alignment["phones"], title)


def _label(coefficient: str) -> str:
    return f"coefficient {coefficient}" if coefficient.isdigit() else coefficient


def _series(runs: Sequence[RunData], utterance: str, coefficient: str) -> dict[str, np.ndarray]:
    """The measured coefficient and that of each run, (T,)."""
    series: dict[str, np.ndarray] = {}
    for run in runs:
        reference, predicted = run.arrays["reference"][utterance], run.arrays["predicted"][utterance]
        place = _place(run, coefficient, reference.shape[1])
        series.setdefault("reference", reference[:, place])
        name = run.settings.labels_name
        series[name if name not in series else run.folder.name] = predicted[:, place]
    return series


def _place(run: RunData, coefficient: str, count: int) -> int:
    """The place of a coefficient of a run, counted from 0.

    Raises:
        DnnvssError: there is none.
    """
    if coefficient.isdigit() and 1 <= int(coefficient) <= count:
        return int(coefficient) - 1
    names = load_face(RunFiles(run.folder).face).names
    if coefficient not in names:
        raise DnnvssError(f"there is no coefficient {coefficient}", file=run.folder,
                          remedy=f"Choose a number from 1 to {count}, or a name such as {names[0]}")
    return names.index(coefficient)
