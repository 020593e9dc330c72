"""How near a predicted trajectory is to the reference, one written definition a metric.

All functions take trajectories (T, D) over the same frames, reference first, and return one number a coefficient,
shape (D,). Cut both to the frames that should count before the call. A reference is *constant* where its standard
deviation is below 1e-9 of its largest magnitude, a prediction also where it moves less than a thousandth of the
reference.

**Where nothing can be measured the answer is NaN**: with a constant reference, correlation and global-variance ratio
are undefined, and with no frame everything is. A constant *prediction* of a reference that moves has correlation 0 by
definition: it says nothing about the movement, and leaving it out would flatter it. Averages leave NaN out; an average
of nothing but NaN is NaN, and tables show it as a dash.
"""

import warnings

import numpy as np

from dnnvss.errors import DnnvssError

_CONSTANT, _STILL = 1e-9, 1e-3


def correlation(reference: np.ndarray, predicted: np.ndarray) -> np.ndarray:
    """Return Pearson's correlation of each coefficient (D,) over the frames of one sentence.

    ``sum (r - mean r)(p - mean p) / sqrt(sum (r - mean r)^2 * sum (p - mean p)^2)``; 0 for a constant prediction, NaN
    for a constant reference.

    **Source**: Thangthai et al. 2016, section 5.
    """
    r, p = _centred(*_pair(reference, predicted))
    scale = np.sqrt((r**2).sum(axis=0) * (p**2).sum(axis=0))
    flat = _constant(reference) | _constant(predicted) | ((p**2).sum(axis=0) <= _STILL**2 * (r**2).sum(axis=0))
    value = (r * p).sum(axis=0) / np.where(flat | (scale == 0), 1.0, scale)
    return np.where(_constant(reference), np.nan, np.where(flat, 0.0, value))


def rmse(reference: np.ndarray, predicted: np.ndarray) -> np.ndarray:
    """Return the root mean square error of each coefficient (D,), in the coefficient's unit.

    ``sqrt(mean over frames of (p - r)^2)``.

    **Source**: Thangthai et al. 2016, section 5.
    """
    r, p = _pair(reference, predicted)
    return _root_mean_square(p - r)


def centred_rmse(reference: np.ndarray, predicted: np.ndarray) -> np.ndarray:
    """Return the root mean square error (D,) after each side's mean over the frames is removed.

    A constant offset a sentence (head pose, light) is a third to two thirds of the squared error and is not movement:
    ``rmse^2 = centred_rmse^2 + (mean p - mean r)^2``.
    """
    r, p = _centred(*_pair(reference, predicted))
    return _root_mean_square(p - r)


def global_variance_ratio(reference: np.ndarray, predicted: np.ndarray) -> np.ndarray:
    """Return ``var(p) / var(r)`` of each coefficient (D,) over the frames: below 1 under-articulates. NaN for a
    constant r.

    **Source**: Toda and Tokuda, A speech parameter generation algorithm considering global variance (2007), section 3.
    """
    r, p = _centred(*_pair(reference, predicted))
    if not len(r):
        return np.full(r.shape[1], np.nan)
    flat = _constant(reference)
    return np.where(flat, np.nan, (p**2).mean(axis=0) / np.where(flat, 1.0, (r**2).mean(axis=0)))


METRICS = {
    "correlation": correlation,
    "rmse": rmse,
    "centred_rmse": centred_rmse,
    "gv_ratio": global_variance_ratio,
}
"""The metrics of every table by name; each maps (T, D) and (T, D) to (D,)."""


def mean_known(values: np.ndarray, axis: int | None = None) -> np.ndarray:
    """Return the mean of the values that are not NaN; NaN where all are."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Mean of empty slice")
        return np.nanmean(values, axis=axis)


def _pair(reference: np.ndarray, predicted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    r, p = np.asarray(reference, dtype=float), np.asarray(predicted, dtype=float)
    if r.ndim != 2 or r.shape != p.shape:
        raise DnnvssError(f"reference {r.shape} and prediction {p.shape} do not have the same frames and coefficients",
                          remedy="Resample one to the clock and frame count of the other")
    if not (np.isfinite(r).all() and np.isfinite(p).all()):
        side = "prediction" if np.isfinite(r).all() else "reference"
        raise DnnvssError(f"the {side} holds values that are not finite", remedy="Leave these frames out by a mask")
    return r, p


def _centred(r: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return (r - r.mean(axis=0), p - p.mean(axis=0)) if len(r) else (r, p)


def _constant(x: np.ndarray) -> np.ndarray:
    x = np.asarray(x, dtype=float)
    if not len(x):
        return np.ones(x.shape[1], dtype=bool)
    return x.std(axis=0) <= _CONSTANT * np.abs(x).max(axis=0)


def _root_mean_square(error: np.ndarray) -> np.ndarray:
    return np.sqrt((error**2).mean(axis=0)) if len(error) else np.full(error.shape[1], np.nan)
