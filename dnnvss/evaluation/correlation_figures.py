"""A study of correlations as a picture, a table and numbers."""

from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.cells import interval
from dnnvss.evaluation.correlations import FIRST, Correlated, Study, correlate
from dnnvss.evaluation.face_figures import find_face
from dnnvss.evaluation.statistics import Estimate
from dnnvss.face.encoding import EncodedCorpus, find_encoding
from dnnvss.formats.tables import markdown_numbers
from dnnvss.render.charts import Line, plot_lines
from dnnvss.runs.files import RunFiles
from dnnvss.runs.settings import RunSettings

_ORDINALS = ("first", "second")
_ROWS = (50, 200, 500, 1000, 2000, 2500)
"""Numbers of frames that stand in the table."""


def write_correlations(study: Study, folder: Path, out: Path | None = None, split: str = "train") -> list[Path]:
    """Make a study and write ``NAME.png``, ``NAME.md`` and ``NAME.json``; their paths.

    Args:
        study: what is compared.
        folder: a run, or an encoding of a corpus.
        out: where to write; ``correlations`` in the folder where None.
        split: whose frames are drawn.

    Raises:
        DnnvssError: no encoding, or fewer frames than are to be drawn.
    """
    out = out or folder / "correlations"
    picture, page, numbers = (out / f"{study.name}.{kind}" for kind in ("png", "md", "json"))
    corpus, encoded, variant = open_encoding(folder)
    files.check_writable([picture, page, numbers])
    found = correlate(study, corpus, encoded, corpus.split(split, variant))
    return [_picture(found, picture), files.write_text(page, markdown(found)), files.write_json(numbers, plain(found))]


def open_encoding(folder: Path) -> tuple[Corpus, EncodedCorpus, str]:
    """The corpus, its encoding and the variant of its splits, from a run or from an encoding.

    Raises:
        DnnvssError: there is none, or the encoding of a run is not kept any more.
    """
    _, root = find_face(folder)
    corpus = Corpus.open(root)
    if not RunFiles(folder).config.is_file():
        return corpus, EncodedCorpus.open(folder), ""
    encoded = find_encoding(corpus, RunFiles(folder).face)
    if encoded is None:
        raise DnnvssError("the codes of its face are not in the corpus any more", file=folder,
                          remedy="Train the run again: it encodes the corpus")
    return corpus, encoded, RunSettings.load(folder).split


def markdown(found: Correlated) -> str:
    """The table of a study: means, and the interval that holds 95 % of the draws."""
    study, rows = found.study, []
    sizes = [n for n in _ROWS if n in study.sizes] or [int(study.sizes[-1])]
    for k in range(len(study.series)):
        for group in found.widths:
            for which in range(FIRST):
                mean, low, high = found.summary(k, group, which)
                at = [int(np.flatnonzero(study.sizes == n)[0]) for n in sizes]
                rows.append([label(found, k), group, str(which + 1),
                             *[interval(Estimate(mean[i], low[i], high[i])) for i in at]])
    about = (f"{found.frames} frames{' of speech' if study.speech else ''} to draw from, {study.repeats} draws; "
             + ", ".join(f"{name}: {width} parameters" for name, width in found.widths.items()))
    head = ["sound", "face", "correlation", *[f"N = {n}" for n in sizes]]
    return f"{about}. In brackets what holds 95 % of the draws.\n\n{markdown_numbers(head, rows)}\n"


def label(found: Correlated, series: int) -> str:
    """What a series is called in a table."""
    own = found.study.series[series]
    several = len({s.context for s in found.study.series}) > 1
    return f"{own.name}, t = {own.context}" if several else own.name


def plain(found: Correlated) -> list[dict[str, object]]:
    """All means and intervals as plain containers."""
    return [{"sound": found.study.series[k].name, "context": found.study.series[k].context, "face": group,
             "correlation": which + 1, "frames": found.study.sizes.tolist(),
             **{name: np.round(values, 5).tolist() for name, values in
                zip(("mean", "low", "high"), found.summary(k, group, which), strict=True)}}
            for k, group in found.values for which in range(FIRST)]


def _picture(found: Correlated, path: Path) -> Path:
    """One panel for each correlation and group of the face."""
    by_context = len(found.study.sizes) == 1
    panels = {f"{_ORDINALS[which]} canonical correlation, {group}": _lines(found, group, which, by_context)
              for which in range(FIRST) for group in found.widths}
    return plot_lines(path, panels, "frames of context on each side" if by_context else "frames",
                      "correlation", columns=len(found.widths))


def _lines(found: Correlated, group: str, which: int, by_context: bool) -> list[Line]:
    study = found.study
    if not by_context:
        return [Line(series.name, study.sizes, *found.summary(k, group, which))
                for k, series in enumerate(study.series)]
    lines = []
    for name in dict.fromkeys(s.name for s in study.series):
        places = sorted((s.context, k) for k, s in enumerate(study.series) if s.name == name)
        points = np.stack([found.summary(k, group, which)[:, 0] for _, k in places], axis=1)
        lines.append(Line(name, np.array([context for context, _ in places]), *points))
    return lines
