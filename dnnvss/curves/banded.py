"""Symmetric positive definite banded systems, many at once, in linear time and memory.

A system is given by its upper diagonals: ``bands[k, t, b, d]`` is the entry in row ``t``, column ``t + k`` of the
matrix of row ``b`` of the batch and column ``d``. Each (b, d) is a system of its own. All kernels share the interface
``factor = factorise(bands)``, ``factor.solve(rhs)``.
"""

from typing import Any, Protocol

import numpy as np
from scipy.linalg import lapack

from dnnvss.curves.padding import SINGULAR, inner, undetermined

_LAPACK_COLUMNS = 400
"""Up to so many columns the compiled sweep down each column wins over a sweep in numpy across the columns
(measured)."""

class Factor(Protocol):
    """A factorised system."""

    def solve(self, padded: Any) -> Any:
        """Return the solutions (T, B, D) for right-hand sides (K + T + K, B, D), float64, whose first and last K are
        zero.

        What is given may be overwritten: a kernel that steps through frames needs no copy then, and no special ends.
        """
        ...


def factorise(bands: Any, batch: int = 1) -> Factor:
    """Return a factor of the systems ``bands`` (K + 1, T, B or 1, D), float64.

    Args:
        bands: upper diagonals, an array, or a tensor on an accelerator, where the factor is one too; a third axis of 1
            means that the whole batch shares the matrices.
        batch: how many rows the right-hand sides will have.

    Raises:
        DnnvssError: a matrix is not positive definite, so that some frames are not determined.
    """
    if not isinstance(bands, np.ndarray):
        from dnnvss.curves.cyclic import CyclicReduction

        return CyclicReduction(bands)
    if max(batch, bands.shape[2]) * bands.shape[3] <= _LAPACK_COLUMNS:
        return Lapack(bands)
    return Sweep(bands)


class Lapack:
    """Banded Cholesky by LAPACK (pbtrf, pbtrs): all columns laid end to end, as blocks of one long system."""

    def __init__(self, bands: np.ndarray) -> None:
        width, frames, self.shared, columns = bands.shape
        laid = np.ascontiguousarray(bands.transpose(2, 3, 1, 0)).reshape(-1, width).T
        factor, info = lapack.dpbtrf(laid, lower=1)
        weak = np.flatnonzero(factor[0] ** 2 < SINGULAR * laid[0])
        if info or len(weak):
            first = info - 1 if info else weak[0]
            b, d, t = np.unravel_index(first, (self.shared, columns, frames))
            raise undetermined((t, b, d))
        self.factor, self.shape = factor, (width, self.shared, columns, frames)

    def unit_factor(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the factor as :func:`_sweep` does: multipliers (T + K, K, B, D) and pivots (T, B, D)."""
        width, batch, columns, frames = self.shape
        factor = self.factor.reshape(width, batch, columns, frames).transpose(0, 3, 1, 2)
        reach = width - 1
        lower = np.zeros((frames + reach, reach, batch, columns))
        for k in range(1, min(width, frames)):
            lower[k:frames, reach - k] = factor[k, : frames - k] / factor[0, : frames - k]
        return lower, np.ascontiguousarray(factor[0] ** 2)

    def solve(self, padded: np.ndarray) -> np.ndarray:
        """Return the solutions (T, B, D)."""
        rhs = inner(padded, self.shape[0] - 1)
        frames, batch, columns = rhs.shape
        sets = batch // self.shared  # right-hand sides for each matrix
        laid = np.ascontiguousarray(rhs.transpose(1, 2, 0)).reshape(sets, -1).T
        solution, _ = lapack.dpbtrs(self.factor, laid, lower=1, overwrite_b=1)
        back = solution.T.reshape(batch, columns, frames).transpose(2, 0, 1)
        return np.ascontiguousarray(back)


class Sweep:
    """LDL' factorisation frame by frame, each step across all columns at once (numpy)."""

    def __init__(self, bands: np.ndarray) -> None:
        self.reach = len(bands) - 1
        if bands[0, 0].size <= _LAPACK_COLUMNS:  # few matrices, shared by a wide batch
            self.lower, self.pivot = Lapack(bands).unit_factor()
        else:
            self.lower, self.pivot = _sweep(bands)

    def solve(self, padded: np.ndarray) -> np.ndarray:
        """Return the solutions (T, B, D), in the memory that was given."""
        reach = self.reach
        x = inner(padded, reach)
        frames, terms = len(x), np.empty((reach, *x.shape[1:]))
        for t in range(1, frames):
            np.multiply(self.lower[t], padded[t : t + reach], terms)
            for term in terms:
                np.subtract(x[t], term, x[t])
        x /= self.pivot
        upper = self._upper()
        for t in range(frames - 2, -1, -1):
            np.multiply(upper[t], padded[t + reach + 1 : t + 2 * reach + 1], terms)
            for term in terms:
                np.subtract(x[t], term, x[t])
        return x

    def _upper(self) -> np.ndarray:
        """Return the multipliers of the later frames, ``upper[t, k - 1] = lower[t + k, K - k]``, without a copy."""
        step = self.lower.strides[1]
        start = self.lower[1:, self.reach - 1 :] if self.reach else self.lower
        shape = (len(self.pivot), *self.lower.shape[1:])
        strides = (self.lower.strides[0], step * (self.reach - 1), *self.lower.strides[2:])
        return np.lib.stride_tricks.as_strided(start, shape, strides, writeable=False)


def _sweep(source: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return multipliers (T + K, K, B, D), ``lower[t, K - k]`` between frames t and t - k, and pivots (T, B, D)."""
    reach, frames = len(source) - 1, source.shape[1]
    lower = np.zeros((frames + reach, reach, *source.shape[2:]))
    pivot = source[0].copy()
    with np.errstate(divide="ignore", invalid="ignore"):  # a pivot of zero is named below
        _eliminate(source, lower, pivot)
    weak = ~(pivot > SINGULAR * source[0])
    if weak.any():
        raise undetermined(tuple(np.argwhere(weak)[0]))
    return lower, pivot


def _eliminate(source: np.ndarray, lower: np.ndarray, pivot: np.ndarray) -> None:
    """Fill multipliers and pivots frame by frame."""
    reach, scratch = len(source) - 1, np.empty_like(pivot[0])
    for t in range(1, source.shape[1]):
        undivided: dict[int, np.ndarray] = {}
        for k in range(min(t, reach), 0, -1):
            undivided[k] = value = source[k, t - k].copy()
            for m in range(min(t, reach), k, -1):
                value -= np.multiply(undivided[m], lower[t - k, reach - (m - k)], out=scratch)
            np.divide(value, pivot[t - k], out=lower[t, reach - k])
            pivot[t] -= np.multiply(value, lower[t, reach - k], out=scratch)
