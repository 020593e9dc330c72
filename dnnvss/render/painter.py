"""Piecewise affine drawing: which triangle owns a pixel of the result, and where its colour comes from."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from dnnvss.aam.mesh import signed_area

_SHIFT = 4
_FLAT = 1e-3
"""Area in square pixels under which a triangle is not drawn: the closed mouth's inside."""


@dataclass(frozen=True)
class Painter:
    """A mesh that is drawn at ever new places from one fixed source picture.

    Args:
        triangles: corners (K, 3), fewer than 255.
        source: corners (K, 3, 2) of each triangle in the source picture, or points (V, 2) of the mesh there.
        fine: triangles (indices) that may be thinner than a pixel; their pixels are found exactly, and win.
        size: height and width of the result.
        background: where a pixel outside the mesh comes from, as an affine map (2, 3) from result to source.
    """

    triangles: np.ndarray
    source: np.ndarray
    fine: np.ndarray
    size: tuple[int, int]
    background: np.ndarray

    @cached_property
    def _corners(self) -> np.ndarray:
        corners = self.source[self.triangles] if self.source.ndim == 2 else self.source
        return np.moveaxis(corners, 1, 2)  # (K, 2, 3): corners as columns

    @cached_property
    def _grid(self) -> tuple[np.ndarray, np.ndarray]:
        height, width = self.size
        return np.arange(width, dtype=np.float32)[None] + 0.5, np.arange(height, dtype=np.float32)[:, None] + 0.5

    @cached_property
    def _coarse(self) -> np.ndarray:
        return np.setdiff1d(np.arange(len(self.triangles)), self.fine)

    def maps(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where each pixel of the result is read: x and y (H, W_) float32, counted between pixel centres.

        Args:
            points: points (V, 2) of the mesh in the result.
        """
        inverse, upright = _inverses(points, self.triangles)
        affine = np.concatenate([self._corners @ inverse, self.background[None]]).astype(np.float32)
        owner = self._owners(points, inverse, upright)
        a = np.take(affine.reshape(-1, 6), owner, axis=0)
        x, y = self._grid
        return (a[..., 0] * x + a[..., 1] * y + (a[..., 2] - np.float32(0.5)),
                a[..., 3] * x + a[..., 4] * y + (a[..., 5] - np.float32(0.5)))

    def paint(self, picture: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return the result (H, W_, 3) with the mesh at ``points`` (V, 2), read from the source picture bicubically."""
        x, y = self.maps(points)
        return cv2.remap(picture, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)

    def _owners(self, points: np.ndarray, inverse: np.ndarray, upright: np.ndarray) -> np.ndarray:
        """Return the triangle (H, W_) uint8 that owns each pixel; the number K stands for the background."""
        owner = np.full(self.size, len(self.triangles), dtype=np.uint8)
        fixed = np.rint((points[self.triangles] - 0.5) * (1 << _SHIFT)).astype(np.int32)
        for k in self._coarse[upright[self._coarse]].tolist():
            cv2.fillConvexPoly(owner, fixed[k], k, cv2.LINE_8, _SHIFT)
        fine = self.fine[upright[self.fine]]
        if len(fine):
            self._own_exactly(owner, points, inverse, fine)
        return owner

    def _own_exactly(self, owner: np.ndarray, points: np.ndarray, inverse: np.ndarray, fine: np.ndarray) -> None:
        """Give the pixels whose centres lie in one of the fine triangles to it."""
        corners = points[self.triangles[fine]].reshape(-1, 2)
        left, top = np.maximum(np.floor(corners.min(axis=0)).astype(int), 0)
        right, bottom = np.minimum(np.ceil(corners.max(axis=0)).astype(int), self.size[::-1])
        if right <= left or bottom <= top:
            return
        x, y = self._grid
        b = inverse[fine][..., None, None]  # (n, 3, 3, 1, 1)
        inside = (b[:, :, 0] * x[:, left:right] + b[:, :, 1] * y[top:bottom] + b[:, :, 2]).min(axis=1) >= 0
        part = owner[top:bottom, left:right]
        part[...] = np.where(inside.any(axis=0), fine[inside.argmax(axis=0)], part)


def _inverses(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return matrices (K, 3, 3) from (x, y, 1) to barycentric coordinates, and which triangles stand upright (K,).

    Flat and turned-over triangles are not upright; their matrices mean nothing.
    """
    area = signed_area(points, triangles)
    upright = area > _FLAT
    (x0, y0), (x1, y1), (x2, y2) = (points[triangles[:, i]].T for i in range(3))
    rows = np.stack([
        np.stack([y1 - y2, x2 - x1, x1 * y2 - x2 * y1], axis=-1),
        np.stack([y2 - y0, x0 - x2, x2 * y0 - x0 * y2], axis=-1),
        np.stack([y0 - y1, x1 - x0, x0 * y1 - x1 * y0], axis=-1),
    ], axis=1)
    return rows / np.where(upright, 2 * area, 1.0)[:, None, None], upright
