"""Vertices that a file keeps more than once become one again, so that the surface has no seams."""

import numpy as np


def weld(
    vertices: np.ndarray, shapes: np.ndarray, triangles: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, shapes and triangles without doubles, and which of the triangles (n,) are left.

    Vertices become one where they lie at the same place, move alike, and look to the same side, so that lips that
    touch stay apart. Vertices of no triangle, and triangles without area, are left out.

    Args:
        vertices: (V, 3).
        shapes: how shapes move them (S, V, 3).
        triangles: corners (n, 3).
    """
    sides = _sides(vertices, triangles)
    mixed = np.tensordot(np.random.default_rng(0).normal(size=len(shapes)), shapes, axes=1)
    key = np.concatenate([vertices, mixed], axis=1).astype(np.float32)
    _, first, of = np.unique(
        np.ascontiguousarray(key).view("V24"), return_index=True, return_inverse=True
    )
    leader = first[of.ravel()]
    alike = (sides * sides[leader]).sum(axis=1) >= 0
    target = np.where(alike, leader, np.arange(len(vertices)))
    corners = target[triangles]
    a, b, c = corners.T
    kept = np.flatnonzero((a != b) & (b != c) & (c != a))
    used, again = np.unique(corners[kept], return_inverse=True)
    return vertices[used], shapes[:, used], again.reshape(-1, 3), kept


def _sides(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The sum of the normals of each vertex's triangles (V, 3)."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    corners, thrice, size = triangles.T.ravel(), np.tile(normals, (3, 1)), len(vertices)
    return np.stack([np.bincount(corners, thrice[:, axis], size) for axis in range(3)], axis=1)
