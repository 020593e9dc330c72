"""The dual of a trajectory under linear ranges: a banded matrix of influences, and the multipliers that it gives."""

from itertools import pairwise

import numpy as np
import scipy.sparse
from scipy.linalg import lapack

from dnnvss.curves.equations import NormalEquations
from dnnvss.errors import DnnvssError

_CHUNK = 256
_DEAD = 1e-9
"""Influence below this share of its peak is cut; the sweeps of :mod:`dnnvss.curves.constraints` make up for it."""
_PATIENCE = 4
_REFINEMENTS = 3


def influences(equations: NormalEquations, rows: scipy.sparse.csr_array, columns: int) -> np.ndarray:
    """Return ``A P^-1 A'`` as lower bands (K + 1, M): entry ``[k, i]`` stands in row ``i + k``, column ``i``.

    What one constraint does to another dies out exponentially with the frames between them, so the matrix is banded and
    is computed in chunks of time, linear in T.

    Args:
        equations: P, a batch of one.
        rows: A, (M, T * D), in order of time.
        columns: D.
    """
    frame, row, vector = _by_frame(rows, columns)
    edges = [0, *(np.flatnonzero(np.diff(frame // _CHUNK)) + 1), len(frame)]
    lags, places, effects = [], [], []
    for start, stop in pairwise(edges):
        touched, column = np.unique(frame[start:stop], return_inverse=True)
        first, inverse = equations.inverse_columns(touched, _DEAD)
        end = np.searchsorted(frame, first + len(inverse))
        own, met = row[start:stop], row[start:end, None]
        response = inverse[frame[start:end] - first] * vector[start:end, None]
        effect = np.einsum("mud,ud->mu", response[:, column], vector[start:stop])
        effect[: len(own)] = np.tril(effect[: len(own)])  # each pair once; its mirror image is not stored
        again = met == own
        np.fill_diagonal(again, False)
        effect[again] *= 2.0  # on the diagonal it is its own mirror image
        lags.append(np.abs(met - own).ravel())
        places.append(np.minimum(met, own).ravel())
        effects.append(effect.ravel())
    lag, place, value = (np.concatenate(parts) for parts in (lags, places, effects))
    bands = np.zeros((lag.max() + 1, rows.shape[0]))
    np.add.at(bands, (lag, place), value)
    used = np.flatnonzero((np.abs(bands) > _DEAD * bands[0].max()).any(axis=1))
    return bands[: used[-1] + 1] if len(used) else bands[:1]


def _by_frame(rows: scipy.sparse.csr_array, columns: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what the rows say of single frames, in order of time: frames (E,), rows (E,) and vectors (E, D)."""
    entries = rows.tocoo()
    pairs, place = np.unique(entries.col.astype(np.int64) // columns * rows.shape[0] + entries.row, return_inverse=True)
    vectors = np.zeros((len(pairs), columns))
    np.add.at(vectors, (place, entries.col % columns), entries.data)
    return pairs // rows.shape[0], pairs % rows.shape[0], vectors


def multiply(bands: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Return the product (M,) of a symmetric matrix given by lower bands and a vector."""
    result = bands[0] * vector
    for k in range(1, len(bands)):
        result[k:] += bands[k, :-k] * vector[:-k]
        result[:-k] += bands[k, :-k] * vector[k:]
    return result


def solve_ranges(
    bands: np.ndarray, value: np.ndarray, low: np.ndarray, high: np.ndarray, guess: np.ndarray | None = None
) -> np.ndarray:
    """Return multipliers u (M,) with ``y = value + S u`` such that ``u > 0`` only at ``y = low``, ``u < 0`` only at
    ``y = high``.

    Elsewhere ``u = 0`` and ``low <= y <= high``; where low and high agree u may have either sign. Block pivoting:
    guess the side of each, solve, correct all that are wrong at once, and one at a time when that no longer helps.

    Args:
        bands: S, lower bands (K + 1, M), positive definite.
        value, low, high: (M,).
        guess: multipliers to start from.

    Raises:
        DnnvssError: the matrix is not positive definite, or the sides do not settle.

    **Source**: Judice and Pires, A block principal pivoting algorithm for large-scale strictly monotone linear
    complementarity problems (1994).
    """
    equal = low == high
    side = np.where(value < low, 1, np.where(value > high, -1, 0)) if guess is None else np.sign(guess).astype(int)
    side[equal] = 1
    fewest, patience = len(value) + 1, _PATIENCE
    slack = 1e-13 * (np.abs(value) + sum(np.abs(np.nan_to_num(b, posinf=0.0, neginf=0.0)) for b in (low, high)))
    for _ in range(200 + 4 * len(value)):
        active = side != 0
        u = np.zeros(len(value))
        if active.any():
            bound = np.where(side > 0, low, high)
            u[active] = _solve(_submatrix(bands, active), (bound - value)[active])
        y = value + multiply(bands, u)
        correct = np.where(active, np.where(equal | (u * side >= 0), side, 0),
                           np.where(y < low - slack, 1, np.where(y > high + slack, -1, 0)))
        wrong = np.flatnonzero(correct != side)
        if not len(wrong):
            return u
        if len(wrong) < fewest:
            fewest, patience = len(wrong), _PATIENCE
        elif patience:
            patience -= 1
        else:
            wrong = wrong[-1:]
        side[wrong] = correct[wrong]
    raise DnnvssError("the constraints could not be reconciled", remedy="Take some of them out or make them soft")


def _submatrix(bands: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Return the lower bands of the rows and columns that are kept."""
    rank = np.cumsum(kept) - 1
    small = np.zeros((len(bands), int(kept.sum())))
    for k in range(len(bands)):
        both = np.flatnonzero(kept[: len(kept) - k] & kept[k:])
        small[rank[both + k] - rank[both], rank[both]] = bands[k, both]
    return small


def _solve(bands: np.ndarray, rhs: np.ndarray) -> np.ndarray:
    """The solution, with the smallest ridge that lets nearly dependent constraints be told apart.

    Each constraint is scaled to an influence of 1 on itself, so that the ridge means the same for a hard one and for
    one so soft that it weighs a billion times more; what the ridge took is put back by refinement.
    """
    size = np.sqrt(bands[0])
    scaled = bands.copy()
    for k in range(min(len(bands), len(size))):
        scaled[k, : len(size) - k] /= size[k:] * size[: len(size) - k]
    for ridge in (1e-13, 1e-11, 1e-9, 1e-7):
        raised = scaled.copy()
        raised[0] += ridge
        factor, info = lapack.dpbtrf(raised, lower=1)
        if not info:
            return _refined(scaled, factor, rhs / size) / size
    raise DnnvssError("the constraints depend on one another too closely to be told apart",
                      remedy="Take some of them out or make them soft")


def _refined(bands: np.ndarray, factor: np.ndarray, rhs: np.ndarray) -> np.ndarray:
    """The solution (M,) for the matrix ``bands``, from the factor of a matrix near it."""
    solution = np.zeros(len(rhs))
    for _ in range(_REFINEMENTS):
        correction, _ = lapack.dpbtrs(factor, rhs - multiply(bands, solution), lower=1)
        solution += correction
    return solution
