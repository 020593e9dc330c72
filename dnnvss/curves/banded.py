"""Symmetric positive definite banded systems, many at once, in linear time and memory.

A system is given by its upper diagonals: ``bands[k, t, b, d]`` is the entry in row ``t``, column ``t + k`` of the
matrix of row ``b`` of the batch and column ``d``. Each (b, d) is a system of its own. All kernels share the interface
``factor = factorise(bands)``, ``factor.solve(rhs)``.
"""

from typing import Protocol

import numpy as np
import torch
from scipy.linalg import lapack

from dnnvss.errors import DnnvssError

_LAPACK_COLUMNS = 400
"""Up to so many columns the compiled sweep down each column wins over a sweep in numpy across the columns
(measured)."""

_SINGULAR = 1e-13
"""A pivot smaller than this share of its diagonal entry means that the frames before leave nothing determined."""


class Factor(Protocol):
    """A factorised system."""

    def solve(self, padded: torch.Tensor) -> torch.Tensor:
        """Return the solutions (T, B, D) for right-hand sides (K + T + K, B, D), float64, whose first and last K are
        zero.

        What is given may be overwritten: a kernel that steps through frames needs no copy then, and no special ends.
        """
        ...


def factorise(bands: torch.Tensor, batch: int = 1) -> Factor:
    """Return a factor of the systems ``bands`` (K + 1, T, B or 1, D), float64, on the device of ``bands``.

    Args:
        bands: upper diagonals; a third axis of 1 means that the whole batch shares the matrices.
        batch: how many rows the right-hand sides will have.

    Raises:
        DnnvssError: a matrix is not positive definite, so that some frames are not determined.
    """
    if bands.is_cuda:
        return CyclicReduction(bands)
    if max(batch, bands.shape[2]) * bands.shape[3] <= _LAPACK_COLUMNS:
        return Lapack(bands)
    return Sweep(bands)


def pad(rhs: torch.Tensor, reach: int) -> torch.Tensor:
    """Return right-hand sides (T, B, D) with ``reach`` zero frames at both ends, as :meth:`Factor.solve` wants them."""
    padded = rhs.new_zeros(len(rhs) + 2 * reach, *rhs.shape[1:])
    padded[reach : reach + len(rhs)] = rhs
    return padded


def _inner(padded: torch.Tensor, reach: int) -> torch.Tensor:
    return padded[reach : len(padded) - reach]


def _undetermined(where: tuple[int, ...]) -> DnnvssError:
    t, b, d = (int(i) for i in where)
    return DnnvssError(
        f"parameter {d} of row {b} is not determined at frame {t}: variances up to it are infinite or too far apart",
        remedy="Give a finite static variance to at least one frame",
    )


class Lapack:
    """Banded Cholesky by LAPACK (pbtrf, pbtrs): all columns laid end to end, as blocks of one long system."""

    def __init__(self, bands: torch.Tensor) -> None:
        width, frames, self.shared, columns = bands.shape
        laid = np.ascontiguousarray(bands.numpy().transpose(2, 3, 1, 0)).reshape(-1, width).T
        factor, info = lapack.dpbtrf(laid, lower=1)
        weak = np.flatnonzero(factor[0] ** 2 < _SINGULAR * laid[0])
        if info or len(weak):
            first = info - 1 if info else weak[0]
            b, d, t = np.unravel_index(first, (self.shared, columns, frames))
            raise _undetermined((t, b, d))
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

    def solve(self, padded: torch.Tensor) -> torch.Tensor:
        """Return the solutions (T, B, D)."""
        rhs = _inner(padded, self.shape[0] - 1)
        frames, batch, columns = rhs.shape
        sets = batch // self.shared  # right-hand sides for each matrix
        laid = np.ascontiguousarray(rhs.numpy().transpose(1, 2, 0)).reshape(sets, -1).T
        solution, _ = lapack.dpbtrs(self.factor, laid, lower=1, overwrite_b=1)
        back = solution.T.reshape(batch, columns, frames).transpose(2, 0, 1)
        return torch.from_numpy(np.ascontiguousarray(back))


class Sweep:
    """LDL' factorisation frame by frame, each step across all columns at once (numpy)."""

    def __init__(self, bands: torch.Tensor) -> None:
        self.reach = len(bands) - 1
        if bands[0, 0].numel() <= _LAPACK_COLUMNS:  # few matrices, shared by a wide batch
            self.lower, self.pivot = Lapack(bands).unit_factor()
        else:
            self.lower, self.pivot = _sweep(bands.numpy())

    def solve(self, padded: torch.Tensor) -> torch.Tensor:
        """Return the solutions (T, B, D), in the memory that was given."""
        reach, whole = self.reach, padded.numpy()
        x = _inner(padded, reach).numpy()
        frames, terms = len(x), np.empty((reach, *x.shape[1:]))
        for t in range(1, frames):
            np.multiply(self.lower[t], whole[t : t + reach], terms)
            for term in terms:
                np.subtract(x[t], term, x[t])
        x /= self.pivot
        upper = self._upper()
        for t in range(frames - 2, -1, -1):
            np.multiply(upper[t], whole[t + reach + 1 : t + 2 * reach + 1], terms)
            for term in terms:
                np.subtract(x[t], term, x[t])
        return torch.from_numpy(x)

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
    weak = ~(pivot > _SINGULAR * source[0])
    if weak.any():
        raise _undetermined(tuple(np.argwhere(weak)[0]))
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


class CyclicReduction:
    """Block cyclic reduction in torch: log2(T) steps, each parallel over frames and columns, for accelerators.

    Frames are taken K at a time, so that the matrix is block tridiagonal with K x K blocks. Each level removes every
    second block.

    **Source**: Buzbee, Golub and Nielson, On direct methods for solving Poisson's equations (1970), section 2, for
        blocks that vary.
    """

    def __init__(self, bands: torch.Tensor) -> None:
        self.reach = len(bands) - 1
        self.size = max(self.reach, 1)
        self.shape = bands.shape[1:]
        diagonal, lower = _blocks(bands, self.size)
        self.levels = []
        while diagonal.shape[0] > 1:
            odd, even = diagonal[1::2], diagonal[::2].clone()
            inverse = self._inverse(odd)
            # `left` couples an odd block to the even one before it, `right` to the even one behind it.
            left, right = lower[1::2], lower[2::2].transpose(-1, -2)
            to_left, to_right = inverse @ left, inverse[: len(right)] @ right
            even[: len(odd)] -= left.transpose(-1, -2) @ to_left
            even[1 : len(right) + 1] -= right.transpose(-1, -2) @ to_right
            coupling = torch.zeros_like(even)
            coupling[1 : len(right) + 1] = -right.transpose(-1, -2) @ to_left[: len(right)]
            self.levels.append((inverse, to_left, to_right))
            diagonal, lower = even, coupling
        self.last = self._inverse(diagonal)

    def _inverse(self, blocks: torch.Tensor) -> torch.Tensor:
        factor, info = torch.linalg.cholesky_ex(blocks)
        own = torch.diagonal(blocks, dim1=-2, dim2=-1)
        weak = torch.diagonal(factor, dim1=-2, dim2=-1) ** 2 < _SINGULAR * own
        if bool(info.any() | weak.any()):
            block, b, d = (torch.nonzero(info > 0) if info.any() else torch.nonzero(weak)[:, :3])[0].tolist()
            raise _undetermined((block * self.size, b, d))
        return torch.cholesky_inverse(factor)

    def solve(self, padded: torch.Tensor) -> torch.Tensor:
        """Return the solutions (T, B, D)."""
        rhs = _inner(padded, self.reach)
        frames, batch, columns = rhs.shape
        count = -(-frames // self.size)
        r = rhs.new_zeros(count * self.size, batch, columns)
        r[:frames] = rhs
        r = r.view(count, self.size, batch, columns).permute(0, 2, 3, 1)[..., None]
        kept = []
        for _, to_left, to_right in self.levels:
            odd, even = r[1::2], r[::2].clone()
            even[: len(odd)] -= to_left.transpose(-1, -2) @ odd
            even[1 : len(to_right) + 1] -= to_right.transpose(-1, -2) @ odd[: len(to_right)]
            kept.append(odd)
            r = even
        x = self.last @ r
        for (inverse, to_left, to_right), odd in zip(reversed(self.levels), reversed(kept), strict=True):
            between = inverse @ odd - to_left @ x[: len(odd)]
            between[: len(to_right)] -= to_right @ x[1 : len(to_right) + 1]
            merged = x.new_empty(len(x) + len(between), *x.shape[1:])
            merged[::2], merged[1::2] = x, between
            x = merged
        return x[..., 0].permute(0, 3, 1, 2).reshape(count * self.size, batch, columns)[:frames]


def _blocks(bands: torch.Tensor, size: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Return diagonal blocks and the blocks left of them, each (blocks, B, D, K, K), of the padded matrix."""
    width, frames, batch, columns = bands.shape
    count = -(-frames // size)
    padded = bands.new_zeros(width, (count + 1) * size, batch, columns)
    padded[:, size : size + frames] = bands  # one empty block in front: the first block has nothing to its left
    padded[0, size + frames :] = 1.0
    grid = padded.view(width, count + 1, size, batch, columns)
    diagonal = bands.new_zeros(count, batch, columns, size, size)
    lower = torch.zeros_like(diagonal)
    for i in range(size):
        for j in range(size):
            if abs(i - j) < width:
                diagonal[..., i, j] = grid[abs(i - j), 1:, min(i, j)]
            if size + i - j < width:
                lower[..., i, j] = grid[size + i - j, :-1, j]
    return diagonal, lower
