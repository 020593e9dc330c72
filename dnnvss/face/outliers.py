"""Shapes that are far out, found by median and median absolute deviation before anything is fitted."""

import numpy as np

from dnnvss import robust

LEAST_STABLE, LEAST_SHAPE, LEAST_PARAMETERS = 0.5, 4.0, 4.0
"""Limits are not set below these: half a pixel (millimetre), four spreads, four deviations of the parameters."""


def spread_of(values: np.ndarray) -> np.ndarray:
    """The robust standard deviation of each column of centred values (F, ...), no less than 0.05."""
    return np.maximum(robust.spread(values), 0.05)


def shape_distance(shapes: np.ndarray, centre: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """The distance (F,) of shapes (F, P, 2 or 3) from a centre: the RMS over coordinates, each by its spread."""
    return np.sqrt((((shapes - centre) / spread) ** 2).mean(axis=(1, 2)))
