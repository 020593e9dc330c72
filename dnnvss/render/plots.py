"""Plots: a coefficient over time with its phones, and the modes of a model."""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.face.base import Face
from dnnvss.render.pictures import still
from dnnvss.timing import FrameClock, Tier

PAGE = 1000
"""Phones of a plot in which each can be read: ten lines."""
COLOURS = ("#222222", "#d1495b", "#2e86ab", "#3c9d6a", "#edae49")
_DPI, _PIXELS = 150, 10e6
"""Dots to an inch, and dots of a picture from which there are fewer to an inch."""
_LINE, _LINES, _CROWD, _DOTS = 100, 30, 200, 4000
"""Phones of a line of a plot over time, from which it goes on in another line below; lines of a plot at most; phones of
a line from which they go without labels and edges, which could not be told apart; and values of a line from which its
least and greatest are drawn of as many together as a dot holds."""


def plot_trajectories(
    path: str | Path,
    series: Mapping[str, np.ndarray],
    rate: Fraction | int | float | str,
    phones: Tier,
    title: str = "",
    label: str = "coefficient",
) -> Path:
    """Write a plot of one coefficient's trajectories over time, with phone boundaries and labels, and return the path.

    **Source**: Thangthai, Theobald 2016, Figure 1.

    Args:
        path: the picture, ``.png``, ``.svg`` or ``.pdf``.
        series: name (reference, predicted, ...) to values (T,); the first is drawn in black.
        rate: frames a second.
        phones: the phone tier, in seconds.
        title: text above the plot.
        label: name of the vertical axis.

    Raises:
        DnnvssError: no series, or one that is not a row of numbers.
    """
    return plot_panels(path, {label: series}, rate, phones, title)


def plot_panels(path: str | Path, panels: Mapping[str, Mapping[str, np.ndarray]],
                rate: Fraction | int | float | str, phones: Tier, title: str = "") -> Path:
    """Write plots of several coefficients below each other, as :func:`plot_trajectories` does of one; their path.

    **Source**: Theobald and Wilkinson 2007, Figures 6 and 7.

    Args:
        path, rate, phones, title: as for :func:`plot_trajectories`.
        panels: name of a coefficient to its series.

    Raises:
        DnnvssError: no series, or one that is not a row of numbers.
    """
    _check_series(path, panels)
    clock, lines = FrameClock(rate), _lines(phones, phones.start, phones.end)
    figure = new_figure(_width(phones), 3.2 * len(lines) * len(panels))
    every = figure.subplots(len(lines) * len(panels), 1, squeeze=False, sharey="row")[:, 0]
    for row, axes in enumerate(every):
        (label, series), span = list(panels.items())[row % len(panels)], lines[row // len(panels)]
        for colour, (name, values) in zip(COLOURS * len(series), series.items(), strict=False):
            axes.plot(*_within(clock, values, span), label=name, color=colour, linewidth=1.4)
        _edges(axes, phones, span, "#bbbbbb")
        _labels(axes, phones, span)
        axes.set(xlim=span, ylabel=label)
    every[-1].set_xlabel("time (s)")
    every[0].set_title(title, pad=16, fontsize=10)
    every[0].legend(loc="upper right", frameon=False, fontsize=8)
    return save_figure(figure, path)


def _check_series(path: str | Path, panels: Mapping[str, Mapping[str, np.ndarray]]) -> None:
    for name, values in (item for series in panels.values() for item in series.items()):
        if np.ndim(values) != 1 or not np.isfinite(values).all():
            raise DnnvssError(f"series {name!r} has shape {np.shape(values)} or holds values that are not finite",
                              file=path, remedy="Give one finite value a frame")
    if not panels or not all(panels.values()):
        raise DnnvssError("there is nothing to plot", file=path, remedy="Give one trajectory at least")


def plot_residual(path: str | Path, series: Mapping[str, np.ndarray], rate: Fraction | int | float | str,
                  valid: np.ndarray, phones: Tier, title: str = "") -> Path:
    """Write a plot of what a model leaves out of each frame, a row for each measure, and return the path.

    Args:
        path: the picture.
        series: name and unit of a measure to its values (F,).
        rate: frames a second.
        valid: (F,) bool; frames that are not are shaded.
        phones: the phone tier, in seconds.
        title: text above.
    """
    clock = FrameClock(rate)
    lines = _lines(phones, 0.0, clock.seconds(len(valid)))
    figure = new_figure(_width(phones), (1.9 * len(series) + 0.4) * len(lines))
    every = figure.subplots(len(series) * len(lines), 1, squeeze=False)[:, 0].reshape(len(lines), len(series))
    for rows, span in zip(every, lines, strict=True):
        for axes, colour, (name, values) in zip(rows, COLOURS[1:] * len(series), series.items(), strict=False):
            axes.plot(*_within(clock, values, span), color=colour, linewidth=1.4)
            axes.axhline(float(np.median(values[valid])) if valid.any() else np.nan, color="#999999", linewidth=0.8,
                         linestyle="--")
            for first, end in _runs(~valid):
                axes.axvspan(clock.seconds(first), clock.seconds(end), color="#eecccc", linewidth=0)
            _edges(axes, phones, span, "#dddddd")
            axes.set(ylabel=name, xlim=span, ylim=(0, 1.05 * float(np.nanmax(values, initial=1e-9))))
            axes.tick_params(labelbottom=axes is rows[-1])
        _labels(rows[0], phones, span)
    every[0, 0].set_title(title, pad=16, fontsize=10)
    every[-1, -1].set_xlabel("time (s)")
    return save_figure(figure, path)


def _width(phones: Tier) -> float:
    """Inches of a plot over time."""
    return max(6.0, 0.22 * min(len(phones), _LINE) + 3)


def _lines(phones: Tier, start: float, end: float) -> list[tuple[float, float]]:
    """Start and end in seconds of each line of a plot, all of one length."""
    edges = np.linspace(start, end, min(-(-len(phones) // _LINE), _LINES) + 1).tolist()
    return list(pairwise(edges))


def _within(clock: FrameClock, values: np.ndarray, span: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Times and values for a line of a plot; of many, those of the line and a frame more that can be seen."""
    if len(values) <= _DOTS:
        return clock.centres(len(values)), values
    first, last = max(clock.edge(span[0]) - 1, 0), min(clock.edge(span[1]) + 1, len(values))
    every = -(-(last - first) // _DOTS)
    if every <= 1:
        return clock.centres(len(values))[first:last], values[first:last]
    whole = values[first : first + (last - first) // every * every].reshape(-1, every)
    shown = np.column_stack([whole.min(axis=1), whole.max(axis=1)]).ravel()
    return np.repeat(clock.centres(len(values))[first + every // 2 :: every][: len(whole)], 2), shown


def _edges(axes: Any, phones: Tier, span: tuple[float, float], colour: str) -> None:
    edges = phones.edges[(phones.edges >= span[0]) & (phones.edges <= span[1])]
    if len(edges) <= _CROWD:
        axes.vlines(edges, 0, 1, color=colour, linewidth=0.6, zorder=0, transform=axes.get_xaxis_transform())


def _labels(axes: Any, phones: Tier, span: tuple[float, float]) -> None:
    """Write the phones of a line above it, if there are not so many that none could be read."""
    middles = [((s.start + s.end) / 2, s.label) for s in phones]
    own = [(at, label) for at, label in middles if span[0] <= at < span[1]]
    for at, label in own if len(own) <= _CROWD else ():
        axes.text(at, 1.01, label, transform=axes.get_xaxis_transform(), ha="center", va="bottom", fontsize=7)


def _runs(mask: np.ndarray) -> list[tuple[int, int]]:
    """First and end of each run of True."""
    changes = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in changes.reshape(-1, 2)]


def plot_modes(path: str | Path, face: Face, count: int = 6, deviations: float = 2.0) -> Path:
    """Write a picture of the first modes, some standard deviations down, at the mean, and up; return the path."""
    count = min(count, len(face.names))
    figure = new_figure(1.5 * count, 3.6)
    grid = figure.subplots(3, count, squeeze=False)
    for mode in range(count):
        for row, amount in enumerate((-deviations, 0.0, deviations)):
            parameters = np.zeros(len(face.names))
            parameters[mode] = amount * face.deviations[mode]
            axes = grid[row, mode]
            axes.imshow(still(face, parameters, zoom=3))
            axes.set_axis_off()
            if row == 0:
                axes.set_title(face.names[mode], fontsize=9)
            if mode == 0:
                axes.text(-0.08, 0.5, f"{amount:+.0f} sd" if amount else "mean", transform=axes.transAxes, rotation=90,
                          va="center", ha="right", fontsize=9)
    return save_figure(figure, path)


def plot_grid(path: str | Path, grids: Mapping[str, np.ndarray], rows: tuple[str, Sequence[Any]],
              columns: tuple[str, Sequence[Any]]) -> Path:
    """Write heat maps side by side with their numbers in the cells, and return the path.

    Args:
        path: the picture.
        grids: title to values (rows, columns); NaN leaves a cell empty.
        rows, columns: what they count, and the value of each.
    """
    figure = new_figure(len(grids) * (1.6 + 0.9 * len(columns[1])), 1.4 + 0.55 * len(rows[1]))
    for axes, (title, values) in zip(figure.subplots(1, len(grids), squeeze=False)[0], grids.items(), strict=True):
        shown = axes.imshow(values, cmap="viridis", aspect="auto")
        digits = max(1, 3 - int(np.log10(max(np.nanmax(np.abs(values)), 1))))
        for (r, c), value in np.ndenumerate(values):
            if np.isfinite(value):
                light = shown.norm(value) > 0.6
                axes.text(c, r, f"{value:.{digits}f}", ha="center", va="center", fontsize=8,
                          color="black" if light else "white")
        axes.set(xticks=range(len(columns[1])), xticklabels=columns[1], xlabel=columns[0],
                 yticks=range(len(rows[1])), yticklabels=rows[1], ylabel=rows[0])
        axes.set_title(title, fontsize=10)
    return save_figure(figure, path)


def new_figure(width: float, height: float) -> Any:
    """An empty figure of some inches, in which every sign of a text means itself (``$`` begins no formula)."""
    import matplotlib as mpl  # slow to import, and rarely needed
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    mpl.rcParams.update({"text.parse_math": False, "text.usetex": False})
    dpi = min(_DPI, (_PIXELS / (width * height)) ** 0.5)  # what is drawn lies in memory as a whole
    figure = Figure(figsize=(width, height), dpi=dpi, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save_figure(figure: Any, path: str | Path) -> Path:
    """Write a figure, whole or not at all, and return its path.

    Raises:
        DnnvssError: a name whose ending is of no picture.
    """
    known = figure.canvas.get_supported_filetypes()
    if Path(path).suffix.lower().removeprefix(".") not in known:
        raise DnnvssError("a picture cannot be written under this name", file=path, remedy="Name it .png, .pdf or .svg")
    if (layout := figure.get_layout_engine()) is not None:
        layout.execute(figure)
        figure.set_layout_engine(None)  # else all is drawn once more for it, as it is for "none"
    packed: dict[str, Any] = {}
    if Path(path).suffix.lower() == ".png":
        packed = {"pil_kwargs": {"compress_level": 1}}  # lines and letters are as small as by 6
    with files.replacing(path) as temporary:
        figure.savefig(temporary, **packed)
    return Path(path)
