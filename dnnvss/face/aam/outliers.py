"""Frames that are far out, found by median and median absolute deviation before anything is fitted."""

from dataclasses import dataclass

import numpy as np

from dnnvss import robust


def spread_of(values: np.ndarray) -> np.ndarray:
    """Return the robust standard deviation of each column of centred values (F, ...) in pixels; no less than 0.05."""
    return np.maximum(robust.spread(values), 0.05)


def shape_distance(shapes: np.ndarray, centre: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """Return the distance (F,) of shapes (F, P, 2) from ``centre``: the RMS over coordinates, each by its spread."""
    return np.sqrt((((shapes - centre) / spread) ** 2).mean(axis=(1, 2)))


def texture_distance(textures: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Return the RMS difference (F,) in grey levels of textures (F, N, 3) from ``centre`` (N, 3)."""
    return np.array([np.sqrt(np.mean((t.astype(np.float32) - centre) ** 2)) for t in textures])


LEAST_STABLE, LEAST_SHAPE, LEAST_TEXTURE, LEAST_PARAMETERS = 0.5, 4.0, 3.0, 4.0
"""Limits of :class:`Limits` are not set below these: half a pixel, four spreads, three grey levels, four deviations."""


@dataclass(frozen=True)
class Limits:
    """The largest values that a frame may have; one above them is an outlier.

    Args:
        stable: RMS distance of the stable points from the reference, in pixels.
        shape: distance of the shape from its clip's median (:func:`shape_distance`).
        texture: RMS difference between the texture and the model's reconstruction of it, in grey levels.
        parameters: root mean square of the parameters in standard deviations of their modes.
    """

    stable: float
    shape: float
    texture: float
    parameters: float
