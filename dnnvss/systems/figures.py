"""What TensorBoard shows of a fit."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from dnnvss.systems.base import Example, Prediction

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ROWS = 5
"""Coefficients that are drawn."""


def trajectory_figure(example: Example, predict: Callable[[Example], Prediction]) -> "Figure":
    """Measured and predicted static coefficients of an utterance."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    mpl.rcParams["text.parse_math"] = False  # an id may hold $
    targets, _ = example.measured
    predicted = predict(example).mean[:, 0]
    rows = min(_ROWS, predicted.shape[1])
    figure = Figure(figsize=(9, 1.6 * rows))
    axes = figure.subplots(rows, 1, sharex=True, squeeze=False)
    for d, axis in enumerate(axes[:, 0]):
        axis.plot(targets[:, 0, d], "k", lw=1, label="measured")
        axis.plot(predicted[:, d], "C0", lw=1, label="predicted")
        axis.set_ylabel(f"coefficient {d + 1}", fontsize=7)
    axes[0, 0].legend(fontsize=7, ncols=2)
    axes[-1, 0].set_xlabel(f"frame of utterance {example.id}")
    return figure
