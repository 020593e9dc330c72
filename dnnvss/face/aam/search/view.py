"""The part of a picture that a level of the search looks at."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

_MARGIN = 0.35
"""What is seen beyond the points on each side, as a share of the larger side of their box."""


@dataclass(frozen=True)
class Crop:
    """A part of a picture, scaled: picture ``image`` (h, w[, C]) float32, whose pixel is ``(picture - origin) * zoom``.

    Args:
        image: what is seen.
        origin: (2, 1) float32 place of its top left corner in the picture.
        zoom: (2, 1) float32 its pixels per pixel of the picture.
    """

    image: np.ndarray
    origin: np.ndarray
    zoom: np.ndarray

    def inside(self, points: np.ndarray) -> np.ndarray:
        """Return picture points (2, P) float32 in pixels of the view."""
        return (points - self.origin) * self.zoom


def crops_of(
    image: np.ndarray, points: np.ndarray, size: float, scales: Sequence[float], colour: str
) -> list[Crop]:
    """Return what lies round points (P, 2) of a picture (H, W_, 3) uint8, at several scales.

    Args:
        image: the picture.
        points: where to look; a corner of the picture where they are all outside.
        size: how large the face is beside the labelled ones.
        scales: pixels of each view per pixel of the labelled pictures.
        colour: ``"grey"`` or ``"rgb"``.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    margin = _MARGIN * float((high - low).max())
    height, width = image.shape[:2]
    x0, x1 = _range(low[0] - margin, high[0] + margin, width)
    y0, y1 = _range(low[1] - margin, high[1] + margin, height)
    part = channels_of(image[y0:y1, x0:x1], colour)
    origin = np.array([[x0], [y0]], np.float32)
    return [_scaled(part, origin, scale / size) for scale in scales]


def _scaled(part: np.ndarray, origin: np.ndarray, zoom: float) -> Crop:
    height, width = part.shape[:2]
    if abs(zoom - 1) > 1e-6:
        target = max(round(width * zoom), 2), max(round(height * zoom), 2)
        part = cv2.resize(part, target, interpolation=cv2.INTER_AREA if zoom < 1 else cv2.INTER_LINEAR)
    return Crop(part, origin, np.array([[part.shape[1] / width], [part.shape[0] / height]], np.float32))


def channels_of(image: np.ndarray, colour: str) -> np.ndarray:
    """Return a picture (H, W_, 3) uint8 as float32: luminance (H, W_), or as it is (H, W_, 3)."""
    if colour == "grey":
        return cv2.cvtColor(np.ascontiguousarray(image), cv2.COLOR_RGB2GRAY).astype(np.float32)
    return image.astype(np.float32)


def _range(low: float, high: float, size: int) -> tuple[int, int]:
    """Return a range of at least two pixels within 0 and ``size``."""
    start = int(np.clip(np.floor(low), 0, max(size - 2, 0)))
    return start, int(np.clip(np.ceil(high), start + 2, max(size, start + 2)))
