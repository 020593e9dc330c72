"""Shapes that are far out, found by median and median absolute deviation before anything is fitted."""

from collections.abc import Mapping, Sequence

import numpy as np

from dnnvss import robust
from dnnvss.archives import Held

LEAST_STABLE, LEAST_SHAPE, LEAST_PARAMETERS = 0.5, 4.0, 4.0
"""Limits are not set below these: half a pixel (millimetre), four spreads, four deviations of the parameters."""
OUTLIER_ARRAYS = {"outlier_reasons": Held(("R",), "U"), "outlier_frames": Held(("R", ...), "b")}
"""The arrays of :func:`outlier_arrays` in the file of a clip's code."""


def outlier_arrays(outliers: Mapping[str, Sequence[int]], frames: int) -> dict[str, np.ndarray]:
    """Outliers as arrays: reasons (R,), and which of the frames (R, F) are out for each.

    Args:
        outliers: reason to frames.
        frames: of the clip (F).
    """
    reasons = sorted(outliers)
    rows = np.zeros((len(reasons), frames), bool)
    for row, reason in zip(rows, reasons, strict=True):
        row[outliers[reason]] = True
    return {"outlier_reasons": np.array(reasons, dtype=str), "outlier_frames": rows}


def outliers_in(arrays: Mapping[str, np.ndarray]) -> dict[str, list[int]]:
    """Reason to frames, of the arrays that :func:`outlier_arrays` made."""
    marks = zip(arrays["outlier_reasons"], arrays["outlier_frames"], strict=True)
    return {str(reason): np.flatnonzero(row).tolist() for reason, row in marks}


def spread_of(values: np.ndarray) -> np.ndarray:
    """The robust standard deviation of each column of centred values (F, ...), no less than 0.05."""
    return np.maximum(robust.spread(values), 0.05)


def shape_distance(shapes: np.ndarray, centre: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """The distance (F,) of shapes (F, P, 2 or 3) from a centre: the RMS over coordinates, each by its spread."""
    return np.sqrt((((shapes - centre) / spread) ** 2).mean(axis=(1, 2)))
