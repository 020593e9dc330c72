"""Charts of numbers: lines with the interval about each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dnnvss.render.plots import COLOURS, new_figure, save_figure

_COLOURS = (*COLOURS, "#7b4fa3", "#8a6d3b", "#5f6b7a")
_STYLES = ("-", "--")
"""Neighbours differ in their dashes too: where two lines meet, both are seen."""


@dataclass(frozen=True)
class Line:
    """A line of a chart: values (n,) at places (n,), and the interval from ``low`` to ``high`` about them."""

    name: str
    at: np.ndarray
    values: np.ndarray
    low: np.ndarray
    high: np.ndarray


def plot_lines(path: str | Path, panels: Mapping[str, Sequence[Line]], across: str, up: str, columns: int = 2) -> Path:
    """Write charts with one pair of axes each, by title, and return the path.

    Args:
        path: the picture, ``.png``, ``.svg`` or ``.pdf``.
        panels: title to lines; a line has one colour in all panels.
        across, up: what the axes count.
        columns: charts beside each other.
    """
    rows = -(-len(panels) // columns)
    figure = new_figure(4.4 * columns, 3.2 * rows)
    every = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey="row").ravel()
    names = list(dict.fromkeys(line.name for lines in panels.values() for line in lines))
    for axes, (title, lines) in zip(every, panels.items(), strict=False):
        for line in lines:
            which = names.index(line.name)
            colour, style = _COLOURS[which % len(_COLOURS)], _STYLES[which % len(_STYLES)]
            few = "o" if len(line.at) < 10 else None
            axes.plot(line.at, line.values, style, color=colour, label=line.name, linewidth=1.4, marker=few,
                      markersize=4)
            axes.fill_between(line.at, line.low, line.high, color=colour, alpha=0.5 / len(names), linewidth=0)
        axes.set_title(title, fontsize=10)
        axes.grid(color="#e5e5e5", linewidth=0.6)
        axes.set_ylim(None, 1)
    for axes in every[len(panels):]:
        axes.set_axis_off()
    for axes in every[-columns:]:
        axes.set_xlabel(across)
    for axes in every[::columns]:
        axes.set_ylabel(up)
    every[0].legend(frameon=False, fontsize=8)
    return save_figure(figure, path)
