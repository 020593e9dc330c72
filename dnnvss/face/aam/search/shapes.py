"""The shapes of the search model: a mean and modes, and the similarity that puts them into a picture.

Points are ``z (mean + p modes) + t`` with ``z`` a turn and growth and ``t`` a place. The modes are orthogonal to the
four moves that a similarity makes of the mean, so that pose and shape are measured apart, exactly.

**Source**: Matthews and Baker 2004, *Active Appearance Models Revisited*, section 4.2 (a global similarity beside the
shape modes).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.aam.mesh import signed_area, triangulate
from dnnvss.face.pca import components
from dnnvss.face.pose import fit_pose, to_reference

_ROUNDS = 10
_MOST = 3.0
"""Standard deviations that no mode leaves."""


@dataclass(frozen=True)
class Shapes:
    """A linear model of point sets up to similarity.

    Args:
        mean: (P, 2) about the origin, in pixels of the labelled pictures at their median scale.
        modes: (K, P, 2), orthonormal, and orthogonal to the moves of a similarity.
        deviations: standard deviation (K,) of each mode over the labelled frames.
        triangles: the mesh (T, 3).
    """

    mean: np.ndarray
    modes: np.ndarray
    deviations: np.ndarray
    triangles: np.ndarray

    @cached_property
    def basis(self) -> np.ndarray:
        """Orthonormal moves (4 + K, P, 2) of the mean: growing, turning, right, down, then the modes."""
        return np.concatenate([moves_of(self.mean), self.modes])

    @cached_property
    def _flat(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What :meth:`project` asks of points (4 + 2 K, 2P), the mean (2P,) and the modes (K, 2P), x then y, float32.

        Rows of the first: growth and turn, place, then every mode, and every mode a quarter turn on.
        """
        mean = self.mean.T
        modes = self.modes.transpose(0, 2, 1)
        turned = np.stack([-modes[:, 1], modes[:, 0]], axis=1)
        pose = np.stack([mean, [-mean[1], mean[0]]]) / (mean**2).sum()
        place = np.zeros((2, *mean.shape))
        place[0, 0] = place[1, 1] = 1 / mean.shape[1]
        asked = np.concatenate([pose, place, modes, turned])
        return (asked.reshape(len(asked), -1).astype(np.float32), mean.ravel().astype(np.float32),
                np.ascontiguousarray(modes.reshape(len(modes), -1), np.float32))

    def project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the model's points (2, P) nearest to points (2, P) float32 of a picture, and their parameters (K,).

        No parameter leaves three standard deviations.
        """
        asked, mean, modes = self._flat
        answers = asked @ points.reshape(-1)
        a, b, x, y = answers[:4].tolist()
        size = max(a * a + b * b, 1e-12)
        count = len(modes)
        parameters = (answers[4:4 + count] * np.float32(a / size) + answers[4 + count:] * np.float32(b / size))
        parameters = np.minimum(np.maximum(parameters, -self._limit), self._limit)
        u, v = (mean + parameters @ modes).reshape(2, -1)
        a, b = np.float32(a), np.float32(b)
        result = np.empty_like(points)
        result[0] = a * u - b * v + np.float32(x)
        result[1] = b * u + a * v + np.float32(y)
        return result, parameters

    @cached_property
    def _limit(self) -> np.ndarray:
        return (_MOST * self.deviations).astype(np.float32)

    def nearest(self, points: np.ndarray) -> np.ndarray:
        """Return the model's points (P, 2) nearest to points (P, 2) of a picture."""
        return self.project(np.asarray(points, np.float32).T)[0].T

    def scale(self, points: np.ndarray) -> np.ndarray:
        """Return the size (...,) of points (..., P, 2) as a multiple of the mean's."""
        poses = fit_pose(points.reshape(-1, *self.mean.shape), self.mean)
        return np.hypot(poses[:, 0], poses[:, 1]).reshape(points.shape[:-2])

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return how far points (F, P, 2) lie from the model's nearest, RMS in pixels of the mean, and how unusual they
        are: rows (2, F), the second the RMS parameter in standard deviations.
        """
        flat = (to_reference(points, fit_pose(points, self.mean), np.zeros(2)) - self.mean).reshape(len(points), -1)
        modes = self.modes.reshape(len(self.modes), -1)
        parameters = flat @ modes.T
        left = np.sqrt(((flat - parameters @ modes) ** 2).mean(axis=1))
        return np.stack([left, np.sqrt(((parameters / self.deviations) ** 2).mean(axis=1))])


def fit_shapes(points: np.ndarray, variance: float) -> Shapes:
    """Return the model of labelled points (N, P, 2) whose modes explain a share of the variance below 1.

    Shapes are aligned by similarities to their common mean (generalised Procrustes analysis).

    Raises:
        DnnvssError: fewer than three frames or three points, or points that lie on one line.
    """
    if len(points) < 3 or points.shape[1] < 3:
        raise DnnvssError(f"{len(points)} labelled frames of {points.shape[1]} points, and a model needs 3 of each",
                          remedy="Label about 30 frames")
    mean = points[0] - points[0].mean(axis=0)
    for _ in range(_ROUNDS):
        aligned = to_reference(points, fit_pose(points, mean), np.zeros(2))
        mean = aligned.mean(axis=0) - aligned.mean(axis=(0, 1))
    scale = np.median(np.hypot(*fit_pose(points, mean)[:, :2].T))
    mean, aligned = mean * scale, aligned * scale
    moves = moves_of(mean).reshape(4, -1)
    rows = (aligned - mean).reshape(len(points), -1)
    rows = rows - (rows @ moves.T) @ moves
    found = components(rows - rows.mean(axis=0), variance)
    modes = found.modes.reshape(-1, *mean.shape)
    return Shapes(mean, modes, np.maximum(found.deviations, 1e-6), mesh_for(mean, aligned))


def mesh_for(mean: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """Return the triangles (T, 3) that fold over least when they are drawn on all of shapes (N, P, 2).

    A mesh chosen on closed lips runs across from lip to lip and folds when they part; one chosen on an open mouth
    seldom does. The meshes of the mean and of every shape are tried, so that no one need say which points are lips.

    Raises:
        DnnvssError: the points lie on one line.
    """
    from scipy.spatial import Delaunay, QhullError  # slow to import, and needed where a model is fitted

    try:
        meshes = [triangulate(s) for s in (mean, *shapes) if len(Delaunay(s).simplices)]
    except QhullError as error:
        raise DnnvssError("the labelled points of a frame lie on one line or in one place",
                          remedy="Label that frame again") from error
    return min(meshes, key=lambda m: _folded(m, mean, shapes))


def _folded(triangles: np.ndarray, mean: np.ndarray, shapes: np.ndarray) -> float:
    """Return the area folded over on the shapes, less a hundredth of the area that the mesh covers of the mean."""
    folded = sum(-np.minimum(signed_area(s, triangles), 0).sum() for s in (mean, *shapes))
    return float(folded - 0.01 * np.abs(signed_area(mean, triangles)).sum())


def moves_of(mean: np.ndarray) -> np.ndarray:
    """Return the orthonormal moves (4, P, 2) of a centred shape: growing, turning, right, down."""
    size = np.linalg.norm(mean)
    turned = np.column_stack([-mean[:, 1], mean[:, 0]])
    right, down = np.zeros_like(mean), np.zeros_like(mean)
    right[:, 0] = down[:, 1] = 1 / np.sqrt(len(mean))
    return np.stack([mean / size, turned / size, right, down])


def slopes(mean: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return matrices (2, P, P): times values at the points, their slope along x and along y at every point.

    The slope at a point is the mean over the triangles round it, weighted by their area. Applied to a shape it gives
    the local map from the mean to the shape, which carries a move of the mean into the picture (first order of the
    composition of warps in Matthews and Baker 2004, section 4.1).
    """
    total, area = np.zeros((2, len(mean), len(mean))), np.zeros(len(mean))
    for triangle in triangles:
        a, b, c = mean[triangle]
        twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        along = np.array([[b[1] - c[1], c[1] - a[1], a[1] - b[1]], [c[0] - b[0], a[0] - c[0], b[0] - a[0]]]) / twice
        for axis in (0, 1):
            total[axis][np.ix_(triangle, triangle)] += abs(twice) * along[axis]
        area[triangle] += abs(twice)
    return total / np.maximum(area, 1e-12)[:, None]
