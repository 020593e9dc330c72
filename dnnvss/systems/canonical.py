"""Canonical correlation of two sets of variables, from their covariance alone, and the regression built on it.

**Source**: Theobald and Wilkinson 2007, section 3.2; Hotelling 1936.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

_RANK = 1e-10
"""A direction with less than this share of the largest variance is none: it is left out, not divided by."""


@dataclass(frozen=True)
class Moments:
    """Mean (C,) and covariance (C, C) of ``count`` rows; covariances are divided by the count."""

    count: int
    mean: np.ndarray
    covariance: np.ndarray

    @classmethod
    def of(cls, chunks: Iterable[np.ndarray]) -> "Moments":
        """The moments of rows (n, C) that come in chunks, which are never held together."""
        count, shift, total, product = 0, np.zeros(0), np.zeros(0), np.zeros((0, 0))
        for chunk in chunks:
            if not count and len(chunk):
                shift = chunk.mean(axis=0, dtype=np.float64)  # sums about a value nearby lose no digits
                total, product = np.zeros(len(shift)), np.zeros((len(shift), len(shift)))
            if len(chunk):
                rows = chunk.astype(np.float64) - shift
                count, total, product = count + len(rows), total + rows.sum(axis=0), product + rows.T @ rows
        return cls(count, shift + total / max(count, 1), product / max(count, 1)
                   - np.multiply.outer(total, total) / max(count, 1) ** 2)


@dataclass(frozen=True)
class Canonical:
    """The canonical factors of x (r variables) and y (s variables).

    Args:
        correlations: (K,) falling.
        x, y: (r, K) and (s, K); ``x' X`` and ``y' Y`` are uncorrelated but in pairs.
    """

    correlations: np.ndarray
    x: np.ndarray
    y: np.ndarray


def canonical(covariance: np.ndarray, width: int, ridge: float = 0.0) -> Canonical:
    """The canonical factors of the first ``width`` variables and the others.

    With ``Cxx^-1/2 Cxy Cyy^-1/2 = U D V'`` the factors are ``wx_i = Cxx^-1/2 u_i`` and ``wy_i = Cyy^-1/2 v_i``, and
    the correlations stand in ``D``. Directions without variance, such as columns that add up to a constant, are left
    out.

    Args:
        covariance: (r + s, r + s), x before y.
        width: r.
        ridge: added to the diagonal of both covariances, in variances of each variable; 0 regularises nothing.

    **Source**: Theobald and Wilkinson 2007, equation 3 and below.
    """
    scale = _deviations(covariance)
    joint = covariance / np.multiply.outer(scale, scale)
    roots = [inverse_root(part + ridge * np.eye(len(part)))
             for part in (joint[:width, :width], joint[width:, width:])]
    u, correlations, v = np.linalg.svd(roots[0] @ joint[:width, width:] @ roots[1], full_matrices=False)
    return Canonical(correlations, roots[0] @ u / scale[:width, None], roots[1] @ v.T / scale[width:, None])


def correlations(covariance: np.ndarray, width: int) -> np.ndarray:
    """The canonical correlations (..., K) of many covariances (..., r + s, r + s) at once; see :func:`canonical`."""
    scale = _deviations(covariance)
    joint = covariance / (scale[..., :, None] * scale[..., None, :])
    x, y = inverse_root(joint[..., :width, :width]), inverse_root(joint[..., width:, width:])
    return np.linalg.svd(x @ joint[..., :width, width:] @ y, compute_uv=False)


def regression(covariance: np.ndarray, width: int, factors: int | None = None, ridge: float = 0.0) -> np.ndarray:
    """The matrix (s, r) that predicts y from x less their means: ``tau Wx'``.

    ``tau = Y Xp' (Xp Xp')^-1`` regresses on the projections ``Xp = Wx' X``. With all factors and no ridge this is the
    least-squares regression of y on x; with fewer it is the one of that rank on what correlates best.

    Args:
        covariance, width, ridge: as for :func:`canonical`.
        factors: how many are kept; all where None.

    **Source**: Theobald and Wilkinson 2007, equations 4 to 6.
    """
    kept = canonical(covariance, width, ridge).x[:, :factors]
    within = kept.T @ covariance[:width, :width] @ kept
    tau = covariance[width:, :width] @ kept @ np.linalg.pinv(within, rcond=_RANK, hermitian=True)
    return tau @ kept.T


def inverse_root(matrix: np.ndarray) -> np.ndarray:
    """``C^-1/2`` of symmetric matrices (..., n, n), zero along directions without variance."""
    values, vectors = np.linalg.eigh(matrix)
    known = values > _RANK * values[..., -1:]
    root = np.where(known, np.where(known, values, 1) ** -0.5, 0)
    return (vectors * root[..., None, :]) @ np.swapaxes(vectors, -1, -2)


def _deviations(covariance: np.ndarray) -> np.ndarray:
    """The standard deviations (..., C); 1 where a variable is constant."""
    deviations = np.sqrt(np.maximum(np.diagonal(covariance, axis1=-2, axis2=-1), 0))
    return np.where(deviations > 0, deviations, 1)
