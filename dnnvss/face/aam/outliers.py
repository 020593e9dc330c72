"""Textures that are far out, and what a frame of an AAM may measure."""

from dataclasses import dataclass

import numpy as np


def texture_distance(textures: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Return the RMS difference (F,) in grey levels of textures (F, N, 3) from ``centre`` (N, 3)."""
    return np.array([np.sqrt(np.mean((t.astype(np.float32) - centre) ** 2)) for t in textures])


LEAST_TEXTURE = 3.0
"""Grey levels below which the limit of :class:`FrameLimits` is not set."""


@dataclass(frozen=True)
class FrameLimits:
    """The largest values that a frame may have; one above them is an outlier.

    Args:
        stable: RMS distance of the stable points from the reference, in pixels.
        shape: distance of the shape from its clip's median (:func:`dnnvss.face.outliers.shape_distance`).
        texture: RMS difference between the texture and the model's reconstruction of it, in grey levels.
        parameters: root mean square of the parameters in standard deviations of their modes.
    """

    stable: float
    shape: float
    texture: float
    parameters: float
