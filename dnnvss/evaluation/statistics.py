"""From sentences to a system: ratios of sums, bootstrap intervals, paired tests.

A metric of a sentence is a pair (amount, weight); of a set of sentences it is the sum of amounts over the sum of
weights. A mean over sentences has weight 1 in each, a recall has counts. Sentences that cannot be measured have weight
0.
"""

from dataclasses import dataclass

import numpy as np

RESAMPLES = 2000
FEWEST = 6
"""Sentences from which an interval or a test can say something: with five, no paired test comes below p = .06."""


@dataclass(frozen=True)
class Estimate:
    """A value with the interval that holds 95 % of bootstrap resamples; NaN where nothing was measured, and in
    the interval where one sentence was."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Difference:
    """Second system less the first, its 95 % interval, and the two-sided p-value of no difference."""

    value: float
    low: float
    high: float
    p: float


def pooled(pairs: np.ndarray) -> float:
    """Return the sum of amounts over the sum of weights of pairs (N, 2); NaN where the weights are zero."""
    amount, weight = pairs.sum(axis=0)
    return float(amount / weight) if weight > 0 else float("nan")


def estimate(pairs: np.ndarray, seed: int = 0, resamples: int = RESAMPLES) -> Estimate:
    """Return the pooled value with its interval: sentences are drawn with replacement, and the 2.5 and 97.5 % points
    taken. One sentence has no interval.

    Args:
        pairs: (N, 2), amount and weight of each sentence.
        seed: of the draws.
        resamples: number of draws.

    **Source**: Efron and Tibshirani, An introduction to the bootstrap (1993), chapter 13 (percentile interval).
    """
    if (pairs[:, 1] > 0).sum() < 2:
        return Estimate(pooled(pairs), float("nan"), float("nan"))
    draws = _draws(len(pairs), seed, resamples)
    low, high = _interval(_ratios(pairs[draws].sum(axis=1)))
    return Estimate(pooled(pairs), low, high)


def difference(first: np.ndarray, second: np.ndarray, seed: int = 0, resamples: int = RESAMPLES) -> Difference:
    """Return how two systems differ on the same sentences.

    The interval draws sentences, the same for both. The p-value is that of a paired permutation test: in each resample
    the two systems are exchanged in a random half of the sentences, and p is the share of resamples whose difference
    is at least as large as the one observed, the observed one included. Sentences that only one system could be
    measured on are left out.

    Args:
        first, second: (N, 2) pairs of the two systems.

    **Source**: Good, Permutation, parametric and bootstrap tests of hypotheses (2005), chapter 3.
    """
    both = (first[:, 1] > 0) & (second[:, 1] > 0)
    first, second = first[both], second[both]
    if not len(first):
        return Difference(*[float("nan")] * 4)
    if len(first) == 1:
        return Difference(pooled(second) - pooled(first), float("nan"), float("nan"), 1.0)
    draws = _draws(len(first), seed, resamples)
    low, high = _interval(_ratios(second[draws].sum(axis=1)) - _ratios(first[draws].sum(axis=1)))
    observed = pooled(second) - pooled(first)
    swap = (np.random.default_rng([seed, 1]).random((resamples, len(first))) < 0.5).astype(float)
    move = second - first
    exchanged = _ratios(second.sum(axis=0) - swap @ move) - _ratios(first.sum(axis=0) + swap @ move)
    slack = 1e-12 * max(abs(pooled(first)), abs(pooled(second)), 1e-300)
    p = (1 + int((np.abs(exchanged) >= abs(observed) - slack).sum())) / (resamples + 1)
    return Difference(observed, low, high, p)


def holm(p_values: list[float]) -> list[float]:
    """Return p-values corrected for their number by Holm's step-down method; NaN stays NaN and does not count."""
    order = [i for i in np.argsort(p_values) if not np.isnan(p_values[i])]
    corrected, largest = [float("nan")] * len(p_values), 0.0
    for rank, i in enumerate(order):
        largest = max(largest, min(1.0, (len(order) - rank) * p_values[i]))
        corrected[i] = largest
    return corrected


def _draws(count: int, seed: int, resamples: int) -> np.ndarray:
    return np.random.default_rng([seed, 0]).integers(0, max(count, 1), size=(resamples, count))


def _ratios(sums: np.ndarray) -> np.ndarray:
    weight = sums[:, 1]
    return np.where(weight > 0, sums[:, 0] / np.where(weight > 0, weight, 1.0), np.nan)


def _interval(values: np.ndarray) -> tuple[float, float]:
    known = values[~np.isnan(values)]
    return tuple(float(v) for v in np.quantile(known, [0.025, 0.975])) if len(known) else (float("nan"), float("nan"))  # type: ignore[return-value]
