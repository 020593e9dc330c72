"""Brushes: smooth outlines, anti-aliased masks, and colour laid over colour."""

from collections.abc import Sequence

import cv2
import numpy as np
from scipy.interpolate import CubicSpline

Colour = tuple[float, float, float] | np.ndarray
Stops = Sequence[tuple[float, tuple[float, float, float]]]
_SHIFT = 4  # binary digits of sub-pixel position that OpenCV is given


def smooth(points: np.ndarray | Sequence[tuple[float, float]], closed: bool = True, steps: int = 12) -> np.ndarray:
    """Return a smooth curve (n, 2) through ``points``, by a cubic spline over the chord length."""
    knots = np.asarray(points, dtype=float)
    if closed:
        knots = np.concatenate([knots, knots[:1]])
    at = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1) ** 0.5)])
    spline = CubicSpline(at, knots, bc_type="periodic" if closed else "natural")
    return spline(np.linspace(0, at[-1], steps * len(knots)))


def mask(shape: tuple[int, int], outline: np.ndarray, *, fine: int = 1, blur: float = 0.0) -> np.ndarray:
    """Return coverage (H, W_) float32 in [0, 1] of the area in ``outline`` (n, 2), drawn ``fine`` times larger."""
    large = np.zeros((shape[0] * fine, shape[1] * fine), np.uint8)
    cv2.fillPoly(large, [_fixed(outline * fine)], 255, cv2.LINE_AA, _SHIFT)
    return _finished(large, shape, fine, blur)


def stroke(shape: tuple[int, int], line: np.ndarray, width: float, *, fine: int = 1, blur: float = 0.0) -> np.ndarray:
    """Return coverage (H, W_) float32 of a pen of ``width`` pixels along ``line`` (n, 2), or several (m, n, 2)."""
    large = np.zeros((shape[0] * fine, shape[1] * fine), np.uint8)
    lines = _fixed(line * fine).reshape(-1, *line.shape[-2:])
    cv2.polylines(large, list(lines), False, 255, max(1, round(width * fine)), cv2.LINE_AA, _SHIFT)
    return _finished(large, shape, fine, blur)


def _fixed(points: np.ndarray) -> np.ndarray:
    return np.round((points - 0.5) * (1 << _SHIFT)).astype(np.int32)  # OpenCV counts from the centre of a pixel


def _finished(large: np.ndarray, shape: tuple[int, int], fine: int, blur: float) -> np.ndarray:
    covered = cv2.resize(large, shape[::-1], interpolation=cv2.INTER_AREA) if fine > 1 else large
    covered = covered.astype(np.float32) / 255
    return cv2.GaussianBlur(covered, (0, 0), blur) if blur > 0 else covered


def lay(picture: np.ndarray, coverage: np.ndarray, colour: Colour, alpha: float = 1.0) -> None:
    """Lay a colour, or a picture of colours, over ``picture`` (H, W_, 3) float32 in place where ``coverage`` says."""
    change = np.asarray(colour, dtype=np.float32) - picture
    change *= (coverage * np.float32(alpha))[..., None]
    picture += change


def gradient(along: np.ndarray, stops: Stops) -> np.ndarray:
    """Return colours (..., 3) float32 for positions ``along`` (...), between the ``stops`` (position, colour)."""
    at = [position for position, _ in stops]
    return np.stack([np.interp(along, at, [c[i] for _, c in stops]) for i in range(3)], axis=-1).astype(np.float32)
