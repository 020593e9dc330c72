"""Plots: a coefficient over time with its phones, and the modes of a model."""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.face.aam import ActiveAppearanceModel
from dnnvss.render.painter import Painter
from dnnvss.render.patch import Patch
from dnnvss.timing import FrameClock, Tier

_COLOURS = ("#222222", "#d1495b", "#2e86ab", "#3c9d6a", "#edae49")


_WIDEST = 120.0
"""Inches, 18,000 pixels: beyond some 530 phones their labels crowd instead of the picture growing."""


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
    for name, values in series.items():
        if np.ndim(values) != 1 or not np.isfinite(values).all():
            raise DnnvssError(f"series {name!r} has shape {np.shape(values)} or holds values that are not finite",
                              file=path, remedy="Give one finite value a frame")
    if not series:
        raise DnnvssError("there is nothing to plot", file=path, remedy="Give one trajectory at least")
    clock = FrameClock(rate)
    figure = _figure(min(max(6.0, 0.22 * len(phones) + 3), _WIDEST), 3.2)
    axes = figure.add_subplot()
    for colour, (name, values) in zip(_COLOURS * len(series), series.items(), strict=False):
        axes.plot(clock.centres(len(values)), values, label=name, color=colour, linewidth=1.4)
    for edge in phones.edges:
        axes.axvline(edge, color="#bbbbbb", linewidth=0.6, zorder=0)
    for segment in phones:
        axes.text((segment.start + segment.end) / 2, 1.01, segment.label, transform=axes.get_xaxis_transform(),
                  ha="center", va="bottom", fontsize=7)
    axes.set(xlim=(phones.start, phones.end), xlabel="time (s)", ylabel=label)
    axes.set_title(title, pad=16, fontsize=10)
    axes.legend(loc="upper right", frameon=False, fontsize=8)
    return _save(figure, path)


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
    times = clock.centres(len(valid))
    figure = _figure(max(6.0, 0.22 * len(phones) + 3), 1.9 * len(series) + 0.4)
    rows = figure.subplots(len(series), 1, squeeze=False, sharex=True)[:, 0]
    for axes, colour, (name, values) in zip(rows, _COLOURS[1:] * len(series), series.items(), strict=False):
        axes.plot(times, values, color=colour, linewidth=1.4)
        axes.axhline(float(np.median(values[valid])), color="#999999", linewidth=0.8, linestyle="--")
        axes.set(ylabel=name, xlim=(0, clock.seconds(len(valid))), ylim=(0, None))
        for frame in np.flatnonzero(~valid).tolist():
            axes.axvspan(clock.seconds(frame), clock.seconds(frame + 1), color="#eecccc", linewidth=0)
        for edge in phones.edges:
            axes.axvline(edge, color="#dddddd", linewidth=0.6, zorder=0)
    for segment in phones:
        rows[0].text((segment.start + segment.end) / 2, 1.01, segment.label, transform=rows[0].get_xaxis_transform(),
                     ha="center", va="bottom", fontsize=7)
    rows[0].set_title(title, pad=16, fontsize=10)
    rows[-1].set_xlabel("time (s)")
    return _save(figure, path)


def plot_modes(path: str | Path, model: ActiveAppearanceModel, count: int = 6, deviations: float = 2.0) -> Path:
    """Write a picture of the first modes, some standard deviations down, at the mean, and up; return the path."""
    count = min(count, model.size)
    figure = _figure(1.5 * count, 3.6)
    grid = figure.subplots(3, count, squeeze=False)
    for mode in range(count):
        for row, amount in enumerate((-deviations, 0.0, deviations)):
            parameters = np.zeros(model.size)
            parameters[mode] = amount * model.deviations[mode]
            axes = grid[row, mode]
            axes.imshow(synthesise(model, parameters, zoom=3))
            axes.set_axis_off()
            if row == 0:
                axes.set_title(model.names[mode], fontsize=9)
            if mode == 0:
                axes.text(-0.08, 0.5, f"{amount:+.0f} sd" if amount else "mean", transform=axes.transAxes, rotation=90,
                          va="center", ha="right", fontsize=9)
    return _save(figure, path)


def plot_grid(path: str | Path, grids: Mapping[str, np.ndarray], rows: tuple[str, Sequence[Any]],
              columns: tuple[str, Sequence[Any]]) -> Path:
    """Write heat maps side by side with their numbers in the cells, and return the path.

    Args:
        path: the picture.
        grids: title to values (rows, columns); NaN leaves a cell empty.
        rows, columns: what they count, and the value of each.
    """
    figure = _figure(len(grids) * (1.6 + 0.9 * len(columns[1])), 1.4 + 0.55 * len(rows[1]))
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
    return _save(figure, path)


def synthesise(model: ActiveAppearanceModel, parameters: np.ndarray, zoom: float = 1.0) -> np.ndarray:
    """Return the picture, uint8 (H, W_, 3), of parameters (D,): decoded texture on decoded shape, on white."""
    points, texture = model.decode(parameters)
    points, warp = Patch(model).parted(points), model.warp
    canvas = warp.picture(np.clip(texture, 0, 255).round().astype(np.uint8), fill=255)
    canvas = np.pad(canvas, ((1, 1), (1, 1), (0, 0)), constant_values=255)
    margin = 6
    height, width = (round((s / warp.scale + 2 * margin) * zoom) for s in warp.size)
    source = (warp.shape - warp.origin) * warp.scale + 1
    inner = np.flatnonzero(np.isin(warp.triangles, model.layout.inner).all(axis=1))
    outside = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, 0.5]])  # the white corner
    painter = Painter(warp.triangles, source, inner, (height, width), outside)
    return painter.paint(canvas, (points - warp.origin + margin) * zoom)


def _figure(width: float, height: float) -> Any:
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # slow to import, and rarely needed
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=150, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _save(figure: Any, path: str | Path) -> Path:
    with files.replacing(path) as temporary:
        figure.savefig(temporary)
    return Path(path)
