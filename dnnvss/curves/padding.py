"""What the kernels of banded systems share: frames of zeros at both ends, and what a frame that nothing determines is
told as."""

from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError

SINGULAR = 1e-13
"""A pivot smaller than this share of its diagonal entry means that the frames before leave nothing determined."""


def pad(rhs: Any, reach: int) -> Any:
    """Return right-hand sides (T, B, D) with ``reach`` zero frames at both ends, as :meth:`Factor.solve` wants them."""
    padded = zeros(rhs, len(rhs) + 2 * reach, *rhs.shape[1:])
    padded[reach : reach + len(rhs)] = rhs
    return padded


def zeros(like: Any, *shape: int) -> Any:
    """Return zeros of the kind of ``like``, which is float64: an array, or a tensor on its device."""
    return np.zeros(shape) if isinstance(like, np.ndarray) else like.new_zeros(shape)


def inner(padded: Any, reach: int) -> Any:
    """Return what :func:`pad` was given."""
    return padded[reach : len(padded) - reach]


def undetermined(where: tuple[int, ...]) -> DnnvssError:
    """Return the error of a frame, row and parameter that nothing determines."""
    t, b, d = (int(i) for i in where)
    return DnnvssError(
        f"parameter {d} of row {b} is not determined at frame {t}: variances up to it are infinite or too far apart",
        remedy="Give a finite static variance to at least one frame",
    )
