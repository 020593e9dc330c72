"""Similarity transforms in space: the turn, scale and shift that carry one shape onto another.

**Source**: Umeyama, "Least-squares estimation of transformation parameters between two point patterns", IEEE PAMI
13(4), 1991, equations 34 to 43.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Similarity:
    """Transforms of N shapes: a reference point ``r`` lies at ``scale * turn (r - pivot) + centre``.

    Args:
        turn: rotations (N, 3, 3).
        scale: (N,); 0 where a shape lies in one point.
        centre: (N, 3).
    """

    turn: np.ndarray
    scale: np.ndarray
    centre: np.ndarray

    def back(self, points: np.ndarray, pivot: np.ndarray) -> np.ndarray:
        """Points (N, P, 3) in the reference frame, for the pivot (3,) that the transforms turn about."""
        scale = np.maximum(self.scale, 1e-12)[:, None, None]
        return (points - self.centre[:, None]) @ self.turn / scale + pivot

    def onto(self, points: np.ndarray, pivot: np.ndarray) -> np.ndarray:
        """Reference points (N, P, 3) where the shapes are: the inverse of :meth:`back`."""
        return (points - pivot) @ np.swapaxes(self.turn, 1, 2) * self.scale[:, None, None] + self.centre[:, None]


def fit_similarity(points: np.ndarray, reference: np.ndarray, rigid: bool = False) -> Similarity:
    """The transforms that carry ``reference`` (P, 3), about its centroid, onto ``points`` (N, P, 3), least squares.

    Args:
        points: the shapes.
        reference: what they are taken for.
        rigid: keep the scale.
    """
    centre = points.mean(axis=1)
    target, source = points - centre[:, None], reference - reference.mean(axis=0)
    left, values, right = np.linalg.svd(np.swapaxes(target, 1, 2) @ source)
    proper = np.ones_like(values)
    proper[:, 2] = np.sign(np.linalg.det(left) * np.linalg.det(right))
    turn = (left * proper[:, None]) @ right
    size = float((source**2).sum())
    scale = np.ones(len(points)) if rigid else (values * proper).sum(axis=1) / max(size, 1e-300)
    return Similarity(turn, scale, centre)
