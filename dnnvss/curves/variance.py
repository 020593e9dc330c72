"""The articulation dial: how far a trajectory moves, by scaling and by a global-variance term in the solve."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import eig_banded, solve_banded

from dnnvss.curves.equations import NormalEquations, precision_of
from dnnvss.curves.multipliers import multiply
from dnnvss.curves.passages import spans
from dnnvss.curves.windows import STATIC_DELTA_DELTA2, Windows
from dnnvss.errors import DnnvssError

STILL = 1e-4
"""A coefficient whose variance is below this share of the talker's does not move: it is not scaled."""
_STEPS = 200


@dataclass(frozen=True)
class GlobalVariance:
    """What is known of the variance of each coefficient within an utterance.

    Args:
        mean: (D,), mean over utterances.
        variance: (D,), variance over utterances of that variance.
    """

    mean: np.ndarray
    variance: np.ndarray

    @classmethod
    def of(cls, trajectories: Iterable[np.ndarray], masks: Iterable[np.ndarray] | None = None) -> "GlobalVariance":
        """Return the statistics of trajectories (T, D), each over the frames of its mask (T,) where masks are given.

        Raises:
            DnnvssError: there are fewer than two utterances with two frames.
        """
        chosen = list(trajectories)
        kept = [np.ones(len(x), bool) for x in chosen] if masks is None else list(masks)
        cut = [np.asarray(x, float)[m] for x, m in zip(chosen, kept, strict=True)]
        values = np.array([x.var(axis=0) for x in cut if len(x) > 1])
        if len(values) < 2:
            raise DnnvssError(f"{len(values)} utterances are too few to tell the variance of variances",
                              remedy="Give two utterances or more")
        return cls(values.mean(axis=0), values.var(axis=0, ddof=1))


def dial(
    columns: int, value: float = 1.0, groups: Mapping[str, Sequence[int]] | None = None, **by_group: float
) -> np.ndarray:
    """Return the articulation of each coefficient, shape (D,).

    Args:
        columns: D.
        value: 0 is flat, 1 the talker's natural variance, above 1 exaggerated.
        groups: name to the positions of its coefficients.
        by_group: another value for the coefficients of a group.

    Raises:
        DnnvssError: a negative value, or a group that is not known.
    """
    settings = np.full(columns, float(value))
    for name, own in by_group.items():
        if name not in (groups or {}):
            raise DnnvssError(f"no group of coefficients is named {name!r}",
                              remedy=f"Use one of {sorted(groups or {})}")
        settings[list((groups or {})[name])] = own
    if not ((settings >= 0) & np.isfinite(settings)).all():
        raise DnnvssError(f"an articulation of {settings.min()} was asked for",
                          remedy="Give 0 (flat), 1 (natural) or more")
    return settings


def movement_of(trajectory: np.ndarray, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance (D,) of a trajectory (T, D) over the frames of a mask (T,), over all where it holds none."""
    chosen = mask if mask.any() else ~mask
    parts = [(trajectory[a:b], chosen[a:b]) for a, b, _ in spans(len(trajectory))]
    if len(parts) == 1:
        kept = trajectory[chosen].astype(float)
        return kept.mean(axis=0), kept.var(axis=0)
    count = chosen.sum()
    centre = np.sum([x[at].sum(axis=0, dtype=float) for x, at in parts], axis=0) / count
    return centre, np.sum([np.square(x[at] - centre).sum(axis=0) for x, at in parts], axis=0) / count


def articulate(
    trajectory: np.ndarray,
    setting: np.ndarray | float,
    natural: np.ndarray,
    own: np.ndarray | None = None,
    mask: np.ndarray | None = None,
    centre: np.ndarray | None = None,
    fade: np.ndarray | None = None,
) -> np.ndarray:
    """Return the trajectory (T, D) with its movement scaled about its centre, by ``g = setting sqrt(n / o)``.

    Each frame becomes ``x + f (g - 1) (x - c)``; with f = 1 that is ``c + g (x - c)``.

    Correlation with the truth does not change, because each coefficient is only stretched; its variance does. A
    coefficient that hardly moves (:data:`STILL`) is left as it is: there is nothing to stretch but rounding.

    Args:
        trajectory: (T, D).
        setting: the dial, a number or (D,); 0 flat, 1 the talker's natural variance.
        natural: n, the talker's variance of each coefficient within an utterance, (D,).
        own: o, the variance that the model's trajectories have on average, (D,): one gain for all utterances, which
            keeps their differences. Where None, this trajectory's own, so that every utterance gets exactly the
            variance asked for.
        mask: (T,) bool, frames over which centre and own variance are taken, e.g. speech; all where None.
        centre: c, (D,); the mean over the mask where None.
        fade: f, (T,), 1 where the dial acts in full, 0 where the trajectory is left as it is; 1 everywhere where None.

    **Source**: Silen et al., Ways to implement global variance in statistical speech synthesis (2012), section 3.
    """
    x = np.asarray(trajectory)
    kept = x[mask] if mask is not None and np.any(mask) else x
    middle = kept.astype(float).mean(axis=0) if centre is None else np.asarray(centre, float)
    spread = kept.astype(float).var(axis=0) if own is None else np.asarray(own, float)
    still = spread <= STILL * np.asarray(natural, float)
    gain = np.asarray(setting) * np.sqrt(np.asarray(natural, float) / np.where(still, 1.0, spread))
    more = np.where(still, 0.0, gain - 1.0) * (x - middle)
    return (x + (more if fade is None else np.asarray(fade)[:, None] * more)).astype(x.dtype)


def with_global_variance(
    trajectory: np.ndarray,
    variance: Any,
    target: GlobalVariance,
    weight: float = 1.0,
    windows: Windows = STATIC_DELTA_DELTA2,
) -> np.ndarray:
    """Return the trajectory (T, D) that is most likely under the prediction and under a Gaussian of its global
    variance.

    For each coefficient it minimises ``(x - x0)' P (x - x0) / (W T) + weight (v(x) - mean)^2 / variance``, where ``P``
    is the matrix of :func:`mlpg`, ``x0`` its trajectory and ``v(x)`` the variance of x over the utterance. The optimum
    solves ``(P + k C) x = P x0`` with C taking the mean away and one number k, which a root search finds: k is negative
    where the variance must grow. Slow movement is amplified most. Linear in T.

    Args:
        trajectory: x0, (T, D).
        variance: variances of the prediction, which broadcast to (T, W, D).
        target: mean and variance of the global variance, (D,) each.
        weight: 0 gives x0 back; 1 is the likelihood of the source.
        windows: the streams of the prediction.

    **Source**: Toda and Tokuda, A speech parameter generation algorithm considering global variance (2007), section 3.
    """
    x0 = np.asarray(trajectory)
    frames, columns = x0.shape
    if weight == 0 or frames < 2:
        return x0
    streams = (1, frames, len(windows), columns)
    bands = NormalEquations(precision_of(variance, streams), windows, None, streams).bands[:, :, 0]
    strength = 2 * len(windows) * weight / np.maximum(target.variance, 1e-300)
    out = np.empty((frames, columns))
    for d in range(columns):
        out[:, d] = _column(np.ascontiguousarray(bands[:, :, d]), x0[:, d].astype(float), target.mean[d], strength[d])
    return out.astype(x0.dtype)


def _column(bands: np.ndarray, x0: np.ndarray, wanted: float, strength: float) -> np.ndarray:
    """Return the minimiser for one coefficient, ``k = strength (v - wanted)``."""
    rhs, lowest = multiply(bands, x0), _lowest(bands)
    excess = strength * (x0.var() - wanted)
    if excess == 0:
        return x0

    def beyond(k: float) -> float:
        """Return how far k is above its own condition; it grows with k, and too low a k has no solution."""
        x = _shifted_solution(bands, rhs, k, lowest)
        return -abs(excess) - bands[0].max() if x is None else k - strength * (x.var() - wanted)

    from scipy.optimize import brentq  # slow to import

    low, high = (-float(lowest[1]), 0.0) if excess < 0 else (0.0, excess)
    k = brentq(beyond, low, high, xtol=1e-12 * bands[0].max(), rtol=1e-13, maxiter=_STEPS)
    x = _shifted_solution(bands, rhs, k, lowest)
    assert x is not None
    return x


def _lowest(bands: np.ndarray) -> np.ndarray:
    """Return the two least eigenvalues of a banded matrix of two rows or more."""
    return eig_banded(bands, lower=True, eigvals_only=True, select="i", select_range=(0, 1))


def _shifted_solution(bands: np.ndarray, rhs: np.ndarray, k: float, lowest: np.ndarray) -> np.ndarray | None:
    """Return the solution of ``(P + k C) x = rhs`` with ``C = I - 1 1' / T``, or None where that has no minimum.

    ``P + k C`` may be positive definite where ``P + k I`` is not: the mean, which C leaves alone, is what P holds
    least. By the lemma on determinants it is, with one negative eigenvalue of ``P + k I``, where the denominator is
    negative.
    """
    negative = int((lowest + k <= 0).sum())
    if negative > 1:
        return None
    shifted = np.concatenate([bands[:0:-1], bands])
    for j in range(1, len(bands)):  # the upper diagonals lie to the right
        shifted[len(bands) - 1 - j] = np.concatenate([np.zeros(j), bands[j, : len(rhs) - j]])
    shifted[len(bands) - 1] += k
    reach = len(bands) - 1
    x, ones = solve_banded((reach, reach), shifted, np.column_stack([rhs, np.ones(len(rhs))])).T
    below = 1.0 - k / len(rhs) * ones.sum()
    if not np.isfinite(below) or (below < 0) != bool(negative):
        return None
    return x + ones * (k / len(rhs) * x.sum() / below)
