"""Meshes that never fold: a shape whose triangles turn over is drawn towards the mean until none does."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dnnvss.face.aam.mesh import signed_areas
from dnnvss.face.lips import lip_pairs, parted

_SKIN = 0.05
"""Share of its area in the mean shape that a triangle of the skin keeps; 0.41 is the least of 11,000 frames of GRID."""
_STEPS = 12
"""Halvings of the way to the mean: it is found to 1/4,000."""


@dataclass(frozen=True)
class FoldGuard:
    """What keeps the shapes of a model from folding.

    Args:
        mean: the model's mean shape (P, 2).
        triangles: its mesh (K, 3).
        inner: positions of the inner lips among the P points.
    """

    mean: np.ndarray
    triangles: np.ndarray
    inner: np.ndarray

    def settled(self, shapes: np.ndarray, centre: np.ndarray | None = None) -> np.ndarray:
        """Shapes (..., P, 2) whose lips meet and never cross, and none of whose triangles is turned over.

        Lips that would pass through each other meet half way. A shape ``c + d`` that still folds becomes ``c + s d``
        with the largest ``s`` that does not: a number for each shape, which changes steadily with it. What does not
        fold stays as it is.

        Args:
            shapes: in the reference frame.
            centre: c, (P, 2), a shape that does not fold; the model's mean where None.
        """
        middle = self.mean if centre is None else centre
        whole = shapes.reshape(-1, *self.mean.shape)
        shown = parted(whole, self._pairs)
        bad = np.flatnonzero(self.folded(shown))
        if len(bad):
            shown[bad] = self._drawn_back(whole[bad] - middle, middle)
        return shown.reshape(shapes.shape)

    def folded(self, shapes: np.ndarray) -> np.ndarray:
        """Whether any triangle of skin in shapes (B, P, 2) is turned over, or next to it, (B,) bool.

        Those between the lips are flat where the lips meet, and are not drawn then.
        """
        return np.asarray((signed_areas(shapes, self.triangles) < self._least).any(axis=1))

    def _drawn_back(self, away: np.ndarray, middle: np.ndarray) -> np.ndarray:
        low, high = np.zeros(len(away)), np.ones(len(away))
        for _ in range(_STEPS):
            half = (low + high) / 2
            folds = self.folded(parted(middle + half[:, None, None] * away, self._pairs))
            low, high = np.where(folds, low, half), np.where(folds, half, high)
        return parted(middle + low[:, None, None] * away, self._pairs)

    @cached_property
    def _pairs(self) -> np.ndarray:
        return lip_pairs(self.mean, self.inner)[0]

    @cached_property
    def _least(self) -> np.ndarray:
        """The least area (K,) of each triangle; none for those between the lips."""
        mouth = np.isin(self.triangles, self.inner).all(axis=1)
        own = signed_areas(self.mean[None], self.triangles)[0]
        return np.where(mouth, -np.inf, _SKIN * np.abs(own))
