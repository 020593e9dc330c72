"""Head pose: similarity transforms from the reference frame to a picture, measured on the stable points.

A pose is ``(a, b, x, y)``: a reference point ``r`` lies at ``[[a, -b], [b, a]] (r - pivot) + (x, y)`` in the picture,
where the pivot is the centroid of the stable reference points. ``hypot(a, b)`` is the scale, ``atan2(b, a)`` the angle.
"""

from dataclasses import dataclass

import numpy as np

from dnnvss.timing import fill_invalid

_LEAST_SIGMA = 0.2
"""Frames; with less, the neighbours have next to no weight, and there is nothing to smooth."""


def fit_pose(points: np.ndarray, reference: np.ndarray, rigid: bool = False) -> np.ndarray:
    """Return the poses (F, 4) that carry ``reference`` (P, 2) onto ``points`` (F, P, 2) with least squares.

    A ``rigid`` pose turns and moves and keeps the scale (Cosker et al. 2004, section 3).
    """
    centre = points.mean(axis=1)
    target, source = _complex(points - centre[:, None]), _complex(reference - reference.mean(axis=0))
    turn = target @ source.conj() / (np.abs(source) ** 2).sum()
    if rigid:
        turn = turn / np.maximum(np.abs(turn), 1e-12)
    return np.column_stack([turn.real, turn.imag, centre])


def to_reference(points: np.ndarray, pose: np.ndarray, pivot: np.ndarray) -> np.ndarray:
    """Return picture points (..., P, 2) in the reference frame, for poses (..., 4)."""
    turn = _complex(pose[..., :2])[..., None]
    return _real(_complex(points - pose[..., None, 2:]) / turn) + pivot


def to_image(points: np.ndarray, pose: np.ndarray, pivot: np.ndarray) -> np.ndarray:
    """Return reference points (..., P, 2) in the picture, for poses (..., 4): the inverse of :func:`to_reference`."""
    turn = _complex(pose[..., :2])[..., None]
    return _real(_complex(points - pivot) * turn) + pose[..., None, 2:]


def mean_shape(points: np.ndarray, rounds: int = 5, rigid: bool = False) -> np.ndarray:
    """Return the generalised Procrustes mean (P, 2) of shapes (F, P, 2) at their median scale, place and angle.

    Each round fits every shape to the mean and averages; the mean then goes back to the median pose.
    """
    mean = np.median(points, axis=0)
    start = mean
    for _ in range(rounds):
        pose = fit_pose(points, mean, rigid)
        mean = np.median(to_reference(points, pose, mean.mean(axis=0)), axis=0)
    back = fit_pose(start[None], mean, rigid)[0]
    return to_image(mean, back, mean.mean(axis=0))


def smooth_pose(pose: np.ndarray, valid: np.ndarray, sigma: float) -> np.ndarray:
    """Return poses (F, 4) smoothed over time by a local straight line with Gaussian weights of ``sigma`` frames.

    A straight line, unlike a weighted mean, is not biased at the ends of a clip. Below 0.2 frames nothing is smoothed,
    and where no other frame has weight to lay a line through, the mean stands in. Frames that are not ``valid`` (F,)
    have no weight; they receive the value of the line, or of their nearest neighbours where none is in reach.
    """
    pose = fill_invalid(pose, valid)
    if sigma < _LEAST_SIGMA or len(pose) < 2:
        return pose
    reach = min(int(np.ceil(4 * sigma)), len(pose) - 1)
    lag = np.arange(-reach, reach + 1)
    kernel = np.exp(-0.5 * (lag / sigma) ** 2)
    weight = valid.astype(float) + 1e-9  # a trace of the filled values where no valid frame is in reach

    def total(values: np.ndarray, power: int) -> np.ndarray:
        full = np.convolve(values, (kernel * lag**power)[::-1])
        return full[reach:reach + len(values)]

    s0, s1, s2 = (total(weight, power) for power in range(3))
    spread = s0 * s2 - s1**2
    flat = spread <= 1e-12 * s0**2
    firm = np.where(flat, 1.0, spread)

    def smooth(values: np.ndarray) -> np.ndarray:
        m0, m1 = (total(weight * values, power) for power in range(2))
        return np.where(flat, m0 / s0, (s2 * m0 - s1 * m1) / firm)

    return np.stack([smooth(y) for y in pose.T], axis=1)


@dataclass(frozen=True)
class PoseReference:
    """The stable points (S, 2) of the reference frame, how poses are smoothed (seconds), and whether they are rigid."""

    stable: np.ndarray
    smoothing: float
    rigid: bool = False

    @property
    def pivot(self) -> np.ndarray:
        """The centroid (2,) of the stable points."""
        return self.stable.mean(axis=0)

    def poses(self, stable: np.ndarray, valid: np.ndarray, rate: float) -> np.ndarray:
        """Return the smoothed poses (F, 4) of stable points (F, S, 2) at ``rate`` frames a second.

        Where no frame is ``valid`` (F,) every pose is the reference's own.
        """
        if not valid.any():
            return np.tile([1.0, 0.0, *self.pivot], (len(stable), 1))
        pose = smooth_pose(fit_pose(stable, self.stable, self.rigid), valid, self.smoothing * rate)
        if self.rigid:
            pose[:, :2] /= np.maximum(np.hypot(pose[:, :1], pose[:, 1:2]), 1e-12)  # the mean of turns is shorter
        return pose

    def residual(self, stable: np.ndarray) -> np.ndarray:
        """Return for each frame the RMS distance (F,) in pixels of stable points (F, S, 2) from the reference.

        Points that all lie in one place are infinitely far.
        """
        pose = fit_pose(stable, self.stable, self.rigid)
        flat = np.hypot(pose[:, 0], pose[:, 1]) < 1e-9
        pose[flat, 0] = 1.0
        gap = to_reference(stable, pose, self.pivot) - self.stable
        return np.where(flat, np.inf, np.sqrt((gap**2).sum(axis=-1).mean(axis=-1)))


def _complex(points: np.ndarray) -> np.ndarray:
    return points[..., 0] + 1j * points[..., 1]


def _real(values: np.ndarray) -> np.ndarray:
    return np.stack([values.real, values.imag], axis=-1)
