"""What TensorBoard shows of a fit."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from dnnvss.face.base import Face, Textured
from dnnvss.systems.base import Example, Prediction

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ROWS = 5
"""Coefficients that are drawn."""
_MOMENTS = 3
"""Frames whose faces are drawn."""


def trajectory_figure(example: Example, predict: Callable[[Example], Prediction], face: Face | None = None
                      ) -> "Figure":
    """Measured and predicted static coefficients of an utterance, and where the face is known some pictures of it.

    Args:
        example: a measured utterance.
        predict: what a system says of it as it stands.
        face: what the coefficients move.
    """
    from matplotlib.figure import Figure

    targets, valid = example.measured
    predicted = predict(example).mean[:, 0]
    rows = min(_ROWS, predicted.shape[1])
    figure = Figure(figsize=(9 if face is None else 14, 1.6 * rows), layout="constrained")
    curves: Any = figure
    if face is not None:
        curves, place = figure.subfigures(1, 2, width_ratios=(9, 5), squeeze=False)[0]
        _draw_faces(place, face, targets[:, 0], predicted, moments_of(targets[:, 0, 0], valid))
    axes = curves.subplots(rows, 1, sharex=True, squeeze=False)
    for d, axis in enumerate(axes[:, 0]):
        axis.plot(targets[:, 0, d], "k", lw=1, label="measured")
        axis.plot(predicted[:, d], "C0", lw=1, label="predicted")
        axis.set_ylabel(f"coefficient {d + 1}", fontsize=7)
    axes[0, 0].legend(fontsize=7, ncols=2)
    axes[-1, 0].set_xlabel(f"frame of utterance {example.id}")
    return figure


def moments_of(track: np.ndarray, valid: np.ndarray) -> list[int]:
    """The measured frames at which a track (T,) is least, median and greatest, in order of time."""
    known = np.flatnonzero(valid)
    order = known[np.argsort(track[known], kind="stable")]
    places = np.linspace(0, len(order) - 1, _MOMENTS).round().astype(int)
    return sorted({int(i) for i in order[places]}) if len(order) else [0]


def _draw_faces(place: Any, face: Face, measured: np.ndarray, predicted: np.ndarray, frames: list[int]) -> None:
    """Draw the face at some frames, as measured above and as predicted below."""
    axes = place.subplots(2, len(frames), squeeze=False)
    for row, (name, track) in enumerate((("measured", measured), ("predicted", predicted))):
        for axis, frame in zip(axes[row], frames, strict=True):
            _draw(axis, face, track[frame].astype(float))
            axis.set_title(f"{name}, frame {frame}", fontsize=7)
            axis.set_axis_off()


def _draw(axis: Any, face: Face, parameters: np.ndarray) -> None:
    """Draw one face: its picture where it has skin, else its lines or points."""
    if isinstance(face, Textured):
        axis.imshow(face.picture(parameters))
        return
    points = face.points(parameters)[:, :2]
    for rows in (face.contours or {"points": range(0)}).values():
        axis.plot(*points[list(rows)].T, "k", lw=1)
    axis.plot(*points.T, "k.", ms=2)
    axis.set_aspect("equal")
    axis.invert_yaxis()
