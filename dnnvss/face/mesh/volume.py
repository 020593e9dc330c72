"""A warp of space that takes the points of one neutral face to those of another.

**Source.** J. D. Edge, M. A. Sanchez, S. Maddock, "Using motion fragments to synthesise visual speech movements", 2004,
section 6 and equation (1): ``f(x) = p(x) + sum a_i phi(|x - c_i|)`` with a polynomial of degree one. Its kernel, the
inverse multiquadric, needs a length; the default here is ``phi(r) = r``, which in space bends least and needs none.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import RBFInterpolator

from dnnvss.errors import DnnvssError

KERNELS = ("linear", "inverse_multiquadric", "thin_plate_spline", "cubic")
_SAME = 1e-7
"""Share of the size of the points within which two of them are one."""
_DEGREE = 1
_STEP = 1e-3
"""Of a step by which slopes are taken, in the source's unit."""


@dataclass(frozen=True)
class Warp:
    """A map of space, by :func:`fit_warp`."""

    interpolator: RBFInterpolator
    origin: np.ndarray
    size: float

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Where points (..., 3) go."""
        flat = (points.reshape(-1, points.shape[-1]) - self.origin) / self.size
        return np.asarray(self.interpolator(flat)).reshape(points.shape)


def fit_warp(source: np.ndarray, target: np.ndarray, kernel: str = "linear") -> Warp:
    """The warp that takes each of the source's points to its own of the target.

    Args:
        source, target: points (P, 3), in any units; points of the source that fall together go to the mean of theirs.
        kernel: of :data:`KERNELS`.

    Raises:
        DnnvssError: other numbers of points, fewer than four that span space, or an unknown kernel.
    """
    if kernel not in KERNELS:
        raise DnnvssError(
            f"no kernel is named {kernel!r}", remedy=f"Use one of {', '.join(KERNELS)}"
        )
    if source.shape != target.shape or source.ndim != 2:
        raise DnnvssError(
            f"{len(source)} points cannot be taken to {len(target)}", remedy="Name as many of both"
        )
    origin = source.mean(axis=0)
    size = float(np.sqrt(((source - origin) ** 2).sum(axis=1).mean())) or 1.0
    own, goal = _merged((source - origin) / size, target)
    spread = np.linalg.svd(own - own.mean(axis=0), compute_uv=False)
    if len(own) < own.shape[1] + 1 or spread[-1] < 1e-6 * spread[0]:
        raise DnnvssError(
            f"{len(own)} points that lie in a line or a plane say nothing of space",
            remedy="Name points of the lips, the nose and the chin, some of them further back",
        )
    distances = np.sqrt(((own[:, None] - own) ** 2).sum(axis=2))
    near = float(np.median(np.sort(distances, axis=1)[:, 1]))
    made = RBFInterpolator(own, goal, kernel=kernel, degree=_DEGREE, epsilon=1 / max(near, 1e-9))
    return Warp(made, origin, size)


def _merged(source: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The points without those that fall together."""
    _, first, of = np.unique(
        np.round(source / _SAME), axis=0, return_index=True, return_inverse=True
    )
    of = of.ravel()
    count = np.bincount(of)[:, None]
    goal = np.stack([np.bincount(of, weights=column) for column in target.T], axis=1) / count
    return source[first], goal


def slopes(warp: Warp, at: np.ndarray) -> np.ndarray:
    """How a warp turns and stretches space at places (n, 3): matrices (n, 3, 3)."""
    if not len(at):
        return np.zeros((0, 3, 3))
    return np.stack(
        [(warp(at + step) - warp(at - step)) / (2 * _STEP) for step in _STEP * np.eye(3)], axis=2
    )
