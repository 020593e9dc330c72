"""From sentences to a system: ratios of sums, bootstrap intervals, paired tests.

A metric of a sentence is a pair (amount, weight); of a set of sentences it is the sum of amounts over the sum of
weights. A mean over sentences has weight 1 in each, a recall has counts. Sentences that cannot be measured have weight
0.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

RESAMPLES = 2000
_AT_ONCE = 2000
"""Permutations whose sums are held at once."""
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
    """Return how two systems differ on the same sentences, see :func:`differences`.

    Args:
        first, second: (N, 2) pairs of the two systems.
    """
    return differences([first, second], [(0, 1)], seed, resamples)[0]


def differences(systems: Sequence[np.ndarray], asked: Sequence[tuple[int, int]], seed: int = 0,
                resamples: int = RESAMPLES, permutations: int | None = None) -> list[Difference]:
    """Return how systems differ on the same sentences, all in one pass over the same draws.

    The interval draws sentences, the same for both. The p-value is that of a paired permutation test: in each
    permutation the two systems are exchanged in a random half of the sentences, and p is the share of permutations
    whose difference is at least as large as the one observed, the observed one included. Sentences that only one
    system could be measured on are left out.

    Args:
        systems: (N, 2) pairs of each.
        asked: which differ: the second of two less the first.
        seed: of the draws.
        resamples: draws of an interval.
        permutations: of a test, as many as the draws unless told; see :func:`enough`.

    **Source**: Good, Permutation, parametric and bootstrap tests of hypotheses (2005), chapter 3.
    """
    found: dict[int, Difference] = {}
    alike: dict[bytes, list[int]] = {}
    for k, (a, b) in enumerate(asked):
        alike.setdefault(((systems[a][:, 1] > 0) & (systems[b][:, 1] > 0)).tobytes(), []).append(k)
    for key, group in alike.items():
        both = np.frombuffer(key, bool)
        first, second = (np.stack([systems[asked[k][side]][both] for k in group], axis=1) for side in (0, 1))
        found |= zip(group, _differences(first, second, seed, resamples, permutations or resamples), strict=True)
    return [found[k] for k in range(len(asked))]


def enough(tests: int) -> int:
    """Permutations with which the smallest p of so many tests is .005 after correction, and no less than usual: a p
    is never below one in the number of permutations, and the correction multiplies it by the number of tests."""
    return max(RESAMPLES, 200 * tests)


def _differences(first: np.ndarray, second: np.ndarray, seed: int, resamples: int,
                 permutations: int) -> list[Difference]:
    """How systems (N, K, 2) differ that were measured on the same sentences."""
    count, tests = first.shape[:2]
    if not count:
        return [Difference(*[float("nan")] * 4)] * tests
    one, other = first.sum(axis=0), second.sum(axis=0)
    observed = _ratios(other) - _ratios(one)
    if count == 1:
        return [Difference(float(value), float("nan"), float("nan"), 1.0) for value in observed]
    draws = _draws(count, seed, resamples)
    times = np.bincount((draws + count * np.arange(resamples)[:, None]).ravel(), minlength=resamples * count)
    times = times.reshape(resamples, count).astype(float)
    drawn = _ratios(_summed(times, second)) - _ratios(_summed(times, first))
    slack = 1e-12 * np.maximum(np.maximum(abs(_ratios(one)), abs(_ratios(other))), 1e-300)
    move, rng, beyond = second - first, np.random.default_rng([seed, 1]), np.zeros(tests, int)
    for start in range(0, permutations, _AT_ONCE):
        swap = (rng.random((min(_AT_ONCE, permutations - start), count)) < 0.5).astype(float)
        moved = _summed(swap, move)
        beyond += (abs(_ratios(other - moved) - _ratios(one + moved)) >= abs(observed) - slack).sum(axis=0)
    return [Difference(float(value), *_interval(drawn[:, k]), (1 + int(beyond[k])) / (permutations + 1))
            for k, value in enumerate(observed)]


def _summed(weights: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Weighted sums (R, K, 2) over the sentences of pairs (N, K, 2), by weights (R, N)."""
    return (weights @ pairs.reshape(len(pairs), -1)).reshape(len(weights), -1, 2)


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
    weight = sums[..., 1]
    return np.where(weight > 0, sums[..., 0] / np.where(weight > 0, weight, 1.0), np.nan)


def _interval(values: np.ndarray) -> tuple[float, float]:
    known = values[~np.isnan(values)]
    return tuple(float(v) for v in np.quantile(known, [0.025, 0.975])) if len(known) else (float("nan"), float("nan"))  # type: ignore[return-value]
