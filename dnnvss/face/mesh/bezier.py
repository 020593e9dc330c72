"""A surface of Bezier triangles through points: it interpolates them and has no gaps between its triangles.

Each triangle is a cubic patch whose nine outer control points follow from the points and normals at
its corners, and each edge from those of its two ends alone, so that neighbours share it; normals
vary quadratically. **Source.** The deformer of J. D. Edge et al. (2004), section 6, equation (3);
the patches are those of A. Vlachos, J. Peters, C. Boyd, J. Mitchell, "Curved PN triangles", 2001.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

_CUBIC = (
    (3, 0, 0),
    (0, 3, 0),
    (0, 0, 3),
    (2, 1, 0),
    (1, 2, 0),
    (0, 2, 1),
    (0, 1, 2),
    (1, 0, 2),
    (2, 0, 1),
    (1, 1, 1),
)
_QUADRATIC = ((2, 0, 0), (0, 2, 0), (0, 0, 2), (1, 1, 0), (0, 1, 1), (1, 0, 1))
_FACTORIAL = np.array([1.0, 1.0, 2.0, 6.0])


def bernstein(powers: tuple[tuple[int, int, int], ...], at: np.ndarray) -> np.ndarray:
    """Bernstein polynomials (n, k) at barycentric coordinates (n, 3)."""
    degree = sum(powers[0])
    columns = [
        _FACTORIAL[degree] / np.prod(_FACTORIAL[list(p)]) * np.prod(at ** np.array(p), axis=1)
        for p in powers
    ]
    return np.stack(columns, axis=1)


@dataclass(frozen=True)
class BezierSurface:
    """Triangles over points; what it gives is linear in the control points, which are not linear in the points.

    Args:
        triangles: corners (T, 3) among P points, counter-clockwise from outside.
        count: P.
    """

    triangles: np.ndarray
    count: int

    @cached_property
    def _gather(self) -> sparse.csr_array:
        """What sums normals of triangles (T,) at their corners (P, T)."""
        corners = self.triangles.ravel()
        ones = np.ones(len(corners))
        return sparse.csr_array(
            (ones, (corners, np.repeat(np.arange(len(self.triangles)), 3))),
            shape=(self.count, len(self.triangles)),
        )

    def normals(self, points: np.ndarray) -> np.ndarray:
        """Normals (P, 3) of length 1 at the points (P, 3); forward where a point has no triangle."""
        a, b, c = (points[self.triangles[:, k]] for k in range(3))
        return _unit(self._gather @ _cross(b - a, c - a))

    def controls(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Control points (T, 10, 3) of the surface and (T, 6, 3) of its normals, for points (P, 3)."""
        p, n = points[self.triangles], self.normals(points)[self.triangles]
        ends = np.roll(p, -1, axis=1) - p
        along = (ends * n).sum(axis=2, keepdims=True)
        back = (ends * np.roll(n, -1, axis=1)).sum(axis=2, keepdims=True)
        near = p + (ends - along * n) / 3
        far = np.roll(p, -1, axis=1) - (ends - back * np.roll(n, -1, axis=1)) / 3
        edges = np.stack([near, far], axis=2).reshape(len(p), 6, 3)
        middle = edges.mean(axis=1, keepdims=True) * 1.5 - p.mean(axis=1, keepdims=True) / 2
        summed = n + np.roll(n, -1, axis=1)
        length = np.maximum((ends**2).sum(axis=2, keepdims=True), 1e-30)
        halves = _unit(summed - 2 * (ends * summed).sum(axis=2, keepdims=True) / length * ends)
        return np.concatenate([p, edges, middle], axis=1), np.concatenate([n, halves], axis=1)

    def points(self, points: np.ndarray, triangle: np.ndarray, at: np.ndarray) -> np.ndarray:
        """Places (n, 3) on the surface of some triangles (n,) at barycentric coordinates (n, 3)."""
        controls, _ = self.controls(points)
        return np.einsum("nk,nkd->nd", bernstein(_CUBIC, at), controls[triangle])

    def weights(self, triangle: np.ndarray, at: np.ndarray) -> tuple[sparse.csr_array, ...]:
        """What makes places, slopes along the triangle's first edge, and normals of the control points.

        Args:
            triangle: (n,).
            at: barycentric coordinates (n, 3).

        Returns:
            Matrices (n, 10 T), (n, 10 T) and (n, 6 T).
        """
        step = 1e-4 * np.array([-1.0, 1.0, 0.0])
        cubic = bernstein(_CUBIC, at)
        slope = (bernstein(_CUBIC, at + step) - bernstein(_CUBIC, at - step)) / 2e-4
        size = len(self.triangles)
        return tuple(
            _placed(rows, triangle, size) for rows in (cubic, slope, bernstein(_QUADRATIC, at))
        )


def _placed(rows: np.ndarray, triangle: np.ndarray, triangles: int) -> sparse.csr_array:
    count, width = rows.shape
    columns = triangle[:, None] * width + np.arange(width)
    ends = np.arange(count + 1) * width
    return sparse.csr_array((rows.ravel(), columns.ravel(), ends), shape=(count, triangles * width))


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    (ax, ay, az), (bx, by, bz) = (np.moveaxis(v, -1, 0) for v in (a, b))
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def _unit(vectors: np.ndarray) -> np.ndarray:
    size = np.sqrt((vectors**2).sum(axis=-1, keepdims=True))
    return np.where(size > 1e-20, vectors / np.maximum(size, 1e-20), [0.0, 0.0, 1.0])
