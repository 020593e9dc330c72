"""Head pose of points in the plane and in space: what stands still is measured, smoothed and taken out.

In the plane a pose is that of :mod:`dnnvss.face.pose`. In space it is ``(m11, m12, ..., m33, x, y, z)``: a reference
point ``r`` lies at ``M (r - pivot) + (x, y, z)``, where ``M`` is a rotation times a scale, and the pivot the centroid
of the stable points.
"""

from dataclasses import dataclass

import numpy as np

from dnnvss.corpus.similarity import Similarity, fit_similarity
from dnnvss.errors import DnnvssError
from dnnvss.face import pose as plane
from dnnvss.face.pose import PoseReference, smooth_pose

_LINE = 0.02
"""Spread of stable points beside their longest axis, over that along it, below which they lie on a line."""


@dataclass(frozen=True)
class SpaceReference:
    """The stable points (S, 3) of the reference frame, and how poses are smoothed (seconds)."""

    stable: np.ndarray
    smoothing: float

    @property
    def pivot(self) -> np.ndarray:
        """The centroid (3,) of the stable points."""
        return self.stable.mean(axis=0)

    def poses(self, stable: np.ndarray, valid: np.ndarray, rate: float) -> np.ndarray:
        """The smoothed poses (F, 12) of stable points (F, S, 3) at ``rate`` frames a second.

        Where no frame is ``valid`` (F,) every pose is the reference's own.
        """
        if not valid.any():
            return np.tile(np.concatenate([np.eye(3).ravel(), self.pivot]), (len(stable), 1))
        found = fit_similarity(stable, self.stable)
        rows = np.concatenate([(found.turn * found.scale[:, None, None]).reshape(-1, 9), found.centre], axis=1)
        return packed(unpacked(smooth_pose(rows, valid, self.smoothing * rate)))

    def residual(self, stable: np.ndarray) -> np.ndarray:
        """The RMS distance (F,) of stable points (F, S, 3) from the reference; infinite for points in one place."""
        found = fit_similarity(stable, self.stable)
        gap = found.back(stable, self.pivot) - self.stable
        return np.where(found.scale < 1e-9, np.inf, np.sqrt((gap**2).sum(axis=-1).mean(axis=-1)))


Reference = PoseReference | SpaceReference


def unpacked(pose: np.ndarray) -> Similarity:
    """The similarity transforms nearest to poses (F, 12), whose matrices may have been averaged."""
    left, values, right = np.linalg.svd(pose[:, :9].reshape(-1, 3, 3))
    proper = np.ones_like(values)
    proper[:, 2] = np.sign(np.linalg.det(left) * np.linalg.det(right))
    return Similarity((left * proper[:, None]) @ right, (values * proper).mean(axis=1), pose[:, 9:])


def packed(transforms: Similarity) -> np.ndarray:
    """Poses (F, 12) of similarity transforms."""
    matrices = (transforms.turn * transforms.scale[:, None, None]).reshape(-1, 9)
    return np.concatenate([matrices, transforms.centre], axis=1)


def taken_out(points: np.ndarray, pose: np.ndarray, reference: Reference) -> np.ndarray:
    """Points (F, P, 2 or 3) in the reference frame, for poses (F, 4 or 12)."""
    if isinstance(reference, PoseReference):
        return plane.to_reference(points, pose, reference.pivot)
    return unpacked(pose).back(points, reference.pivot)


def put_back(points: np.ndarray, pose: np.ndarray, reference: Reference) -> np.ndarray:
    """Reference points (F, P, 2 or 3) where the recording has them: the inverse of :func:`taken_out`."""
    if isinstance(reference, PoseReference):
        return plane.to_image(points, pose, reference.pivot)
    return unpacked(pose).onto(points, reference.pivot)


def learn_reference(points: np.ndarray, stable: np.ndarray, corners: tuple[int, int], smoothing: float) -> Reference:
    """The reference frame of frames with landmarks (F, L, 2 or 3).

    In the plane it is that of the median picture. In space its axes are the face's own: x from corner to corner of the
    mouth, y downward along the longest extent of all landmarks square to it, z away from the viewer.

    Args:
        points: all landmarks.
        stable: rows of those that speech does not move.
        corners: rows of the mouth's corners, the one with the smaller x first.
        smoothing: time constant of poses in seconds.

    Raises:
        DnnvssError: in space, fewer than three stable points, or all on a line.
    """
    if points.shape[2] == 2:
        return PoseReference(plane.mean_shape(points[:, stable]), smoothing)
    mean = _space_mean(points[:, stable])
    spread = np.linalg.svd(mean - mean.mean(axis=0), compute_uv=False)
    if len(mean) < 3 or spread[1] < _LINE * spread[0]:
        raise DnnvssError(f"the {len(mean)} stable points lie on a line, which does not tell head pose in space",
                          remedy="Name stable points of brows, eyes and nose in face.points.stable")
    pivot = mean.mean(axis=0)
    face = fit_similarity(points[:, stable], mean).back(points, pivot).mean(axis=0)
    return SpaceReference((mean - pivot) @ _axes(face, pivot, corners).T + pivot, smoothing)


def _axes(face: np.ndarray, pivot: np.ndarray, corners: tuple[int, int]) -> np.ndarray:
    """The axes (3, 3), one a row, of a face (L, 3) with the stable points round ``pivot`` (3,)."""
    mouth = face[list(corners)]
    right = (mouth[1] - mouth[0]) / max(float(np.linalg.norm(mouth[1] - mouth[0])), 1e-12)
    centred = face - face.mean(axis=0)
    down = np.linalg.svd(centred - np.outer(centred @ right, right))[2][0]
    down = down if down @ (mouth.mean(axis=0) - pivot) >= 0 else -down
    return np.stack([right, down, np.cross(right, down)])


def _space_mean(points: np.ndarray, rounds: int = 5) -> np.ndarray:
    """The generalised Procrustes mean (S, 3) of shapes (F, S, 3) at their median scale and place."""
    mean = np.median(points, axis=0)
    start = mean
    for _ in range(rounds):
        mean = np.median(fit_similarity(points, mean).back(points, mean.mean(axis=0)), axis=0)
    own = fit_similarity(start[None], mean)
    return np.asarray(own.onto(mean[None], mean.mean(axis=0))[0])
