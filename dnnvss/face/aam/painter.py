"""Piecewise affine drawing: which triangle owns a pixel of the result, and where its colour comes from."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

_SHIFT = 4
_TABLE = 256
"""Entries of a table of ``cv2.LUT``."""
_FLAT = 1e-3
"""Area in square pixels under which a triangle is not drawn: the closed mouth's inside."""
_THIN = 4.0
"""How much more of the source than the middle triangle of the mesh one reads along a pixel, from which it is thin."""


@dataclass(frozen=True)
class PaintPlan:
    """Where the triangles of some pictures lie: what is cheaper to find for many at once.

    Args:
        points: points (B, V, 2) of the mesh in each result.
        inverse: matrices (B, K, 3, 3) from (x, y, 1) to barycentric coordinates.
        upright: (B, K) bool, the triangles that are drawn.
        affine: maps (B, 6, K + 1 or more) float32 from result to source, row-major, the background's last.
        thin: (B, K) bool, the triangles that are squeezed in the result and wide in the source.
        fine_boxes: left, top, right, bottom in pixels of what the fine triangles cover, of each picture.
    """

    points: np.ndarray
    inverse: np.ndarray
    upright: np.ndarray
    affine: np.ndarray
    thin: np.ndarray
    fine_boxes: list[list[int]]


@dataclass(frozen=True)
class Painter:
    """A mesh that is drawn at ever new places from one fixed source picture.

    Triangles reach half a pixel beyond their edges, so that none is left out between two. Of those that reach a pixel
    the first in order owns it, and none that is thin in the result and wide in the source: it reads far beyond its own
    corners there, as a corner of the lips that shuts, or what surrounds a mesh, which so stands behind it in order.

    Args:
        triangles: corners (K, 3).
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
    def _coarse(self) -> list[int]:
        """Those that are not fine, the last first: what is drawn later owns the pixel."""
        return np.setdiff1d(np.arange(len(self.triangles)), self.fine)[::-1].tolist()

    @cached_property
    def _polygons(self) -> tuple[np.ndarray, list[np.ndarray]]:
        """Corners (K, 3, 2) in 1/16 pixel, written anew for each picture, and a view of each triangle's."""
        fixed = np.zeros((len(self.triangles), 3, 2), dtype=np.int32)
        return fixed, list(fixed)

    @property
    def _owner_type(self) -> type:
        """The smallest kind of number that counts all triangles and the background: ``cv2.LUT`` reads bytes."""
        return np.uint8 if len(self.triangles) < _TABLE else np.uint16

    def plan(self, points: np.ndarray) -> PaintPlan:
        """Return the plan of pictures with the mesh at ``points`` (B, V, 2)."""
        inverse, upright = _inverses(points, self.triangles)
        count = len(self.triangles)
        affine = np.zeros((len(points), 6, max(count + 1, _TABLE)), dtype=np.float32)
        affine[:, :, :count] = np.moveaxis((self._corners @ inverse).reshape(len(points), count, 6), 1, 2)
        affine[:, :, count] = self.background.ravel()
        affine[:, 2::3] -= np.float32(0.5)  # remap counts from the centre of the first pixel
        return PaintPlan(points, inverse, upright, affine, _thin(affine[:, :, :count], upright),
                         self._fine_boxes(points))

    def maps(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where each pixel of the result is read: x and y (H, W_) float32, counted between pixel centres.

        Args:
            points: points (V, 2) of the mesh in the result.
        """
        return self._maps(self.plan(points[None]), 0)

    def paint(self, picture: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return the result (H, W_, 3) with the mesh at ``points`` (V, 2), read from the source picture bicubically."""
        return self.paint_planned(picture, self.plan(points[None]), 0)

    def paint_planned(self, picture: np.ndarray, plan: PaintPlan, index: int) -> np.ndarray:
        """Return the result (H, W_, 3) number ``index`` of a plan, read from the source picture bicubically."""
        x, y = self._maps(plan, index)
        return cv2.remap(picture, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)

    def _maps(self, plan: PaintPlan, index: int) -> tuple[np.ndarray, np.ndarray]:
        owner = self._owners(plan, index)
        look_up = cv2.LUT if owner.dtype == np.uint8 else _taken
        xx, xy, x0, yx, yy, y0 = (look_up(owner, row) for row in plan.affine[index])
        x, y = self._grid
        for values, factor in ((xx, x), (xy, y), (yx, x), (yy, y)):
            values *= factor
        xx += xy
        xx += x0
        yx += yy
        yx += y0
        return xx, yx

    def _owners(self, plan: PaintPlan, index: int) -> np.ndarray:
        """Return the triangle (H, W_) that owns each pixel; the number K stands for the background."""
        owner: np.ndarray = np.full(self.size, len(self.triangles), dtype=self._owner_type)
        fixed, polygons = self._polygons
        points, upright = plan.points[index], plan.upright[index]
        np.rint((points[self.triangles] - 0.5) * (1 << _SHIFT), out=fixed, casting="unsafe")
        drawn, thin = upright.tolist(), plan.thin[index].tolist()
        for k in sorted(self._coarse, key=lambda k: not thin[k]):
            if drawn[k]:
                cv2.fillConvexPoly(owner, polygons[k], k, cv2.LINE_8, _SHIFT)
        self._own_exactly(owner, plan, index)
        return owner

    def _own_exactly(self, owner: np.ndarray, plan: PaintPlan, index: int) -> None:
        """Give the pixels whose centres lie in one of the fine triangles to it."""
        left, top, right, bottom = plan.fine_boxes[index]
        drawn = plan.upright[index, self.fine]
        if right <= left or bottom <= top or not drawn.any():
            return
        fine = self.fine[drawn]
        x, y = self._grid
        b = plan.inverse[index, fine][..., None, None]  # (n, 3, 3, 1, 1)
        inside = (b[:, :, 0] * x[:, left:right] + b[:, :, 2]) + b[:, :, 1] * y[top:bottom] >= 0
        part = owner[top:bottom, left:right]
        for k, own in zip(fine[::-1].tolist(), inside.all(axis=1)[::-1], strict=True):
            part[own] = k

    def _fine_boxes(self, points: np.ndarray) -> list[list[int]]:
        """Return left, top, right, bottom (B, 4) of the pixels that the fine triangles may own."""
        if not len(self.fine):
            return [[0, 0, 0, 0]] * len(points)
        corners = points[:, np.unique(self.triangles[self.fine])]
        low = np.maximum(np.floor(corners.min(axis=1)), 0)
        high = np.minimum(np.ceil(corners.max(axis=1)), self.size[::-1])
        return np.concatenate([low, high], axis=1).astype(int).tolist()


def _thin(affine: np.ndarray, upright: np.ndarray) -> np.ndarray:
    """Which triangles (B, K) read much more of the source along a pixel than the middle one, by maps (B, 6, K)."""
    xx, xy, _, yx, yy, _ = np.moveaxis(affine.astype(float), 1, 0)
    half, area = (xx**2 + xy**2 + yx**2 + yy**2) / 2, xx * yy - xy * yx
    widest = np.sqrt(half + np.sqrt(np.maximum(half**2 - area**2, 0)))  # the greater singular value
    counted = upright | ~upright.any(axis=1, keepdims=True)  # of a picture without a triangle any will do
    middle = np.nanmedian(np.where(counted, widest, np.nan), axis=1, keepdims=True)
    return upright & (widest > _THIN * middle)


def _taken(owner: np.ndarray, row: np.ndarray) -> np.ndarray:
    return np.take(row, owner)


def _inverses(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return matrices (..., K, 3, 3) from (x, y, 1) to barycentric coordinates, and which triangles stand upright.

    Flat and turned-over triangles are not upright (..., K); their matrices mean nothing.
    """
    corners = points[..., triangles, :]
    (x0, y0), (x1, y1), (x2, y2) = (np.moveaxis(corners[..., i, :], -1, 0) for i in range(3))
    area = 0.5 * ((x1 - x0) * (y2 - y0) - (y1 - y0) * (x2 - x0))
    upright = area > _FLAT
    rows = np.stack([
        np.stack([y1 - y2, x2 - x1, x1 * y2 - x2 * y1], axis=-1),
        np.stack([y2 - y0, x0 - x2, x2 * y0 - x0 * y2], axis=-1),
        np.stack([y0 - y1, x1 - x0, x0 * y1 - x1 * y0], axis=-1),
    ], axis=-2)
    return rows / np.where(upright, 2 * area, 1.0)[..., None, None], upright
