"""How many prefer one of two: exact binomial intervals and tests, and shares that stand for all viewers."""

from dataclasses import dataclass

import numpy as np
from scipy import stats


@dataclass(frozen=True)
class Share:
    """A share or a mean with its 95 % interval and the two-sided p of chance; NaN where there is none."""

    value: float
    low: float
    high: float
    p: float


_UNKNOWN = float("nan")
NOTHING = 1e-6
"""A standard error of less than this share of its value is rounding: nothing varied."""


def exact_share(successes: int, count: int, chance: float = 0.5) -> Share:
    """A share of independent judgements, with the interval of Clopper and Pearson and the exact binomial test.

    Args:
        successes: of the judgements.
        count: of all; without any, all is NaN.
        chance: what is tested.

    **Source**: Clopper and Pearson (1934).
    """
    if not count:
        return Share(*[_UNKNOWN] * 4)
    low = float(stats.beta.ppf(0.025, successes, count - successes + 1)) if successes else 0.0
    high = float(stats.beta.ppf(0.975, successes + 1, count - successes)) if successes < count else 1.0
    return Share(successes / count, low, high, float(stats.binomtest(successes, count, chance).pvalue))


def mean_interval(values: np.ndarray, chance: float = 0.0) -> Share:
    """The mean of a number for each viewer, with the t interval over viewers and the t test of ``chance``.

    Judgements of one viewer hang together, and viewers do not: this interval is for viewers who were not asked.
    Viewers who are all alike give none: two who agree are not certainty.

    Args:
        values: (viewers,).
        chance: what is tested.
    """
    n = len(values)
    mean = float(np.mean(values)) if n else _UNKNOWN
    error = float(np.std(values, ddof=1) / np.sqrt(n)) if n > 1 else _UNKNOWN
    return t_interval(mean, error, n - 1, chance)


def t_interval(value: float, error: float, degrees: int, chance: float = 0.0) -> Share:
    """A value with the t interval and the t test of ``chance``; neither where nothing varied.

    Args:
        value: an estimate.
        error: its standard error.
        degrees: of freedom.
        chance: what is tested.
    """
    if degrees < 1 or not error > NOTHING * max(1.0, abs(value)):
        return Share(value, _UNKNOWN, _UNKNOWN, _UNKNOWN)
    half = float(stats.t.ppf(0.975, degrees)) * error
    p = float(2 * stats.t.sf(abs(value - chance) / error, degrees))
    return Share(value, value - half, value + half, p)


def share_over_viewers(shares: np.ndarray, chance: float = 0.5) -> Share:
    """The mean of viewers' own shares (viewers,), with an interval over viewers that stays within 0 and 1."""
    found = mean_interval(shares, chance)
    return Share(found.value, max(found.low, 0.0), min(found.high, 1.0), found.p)


def majorities(shares: np.ndarray) -> tuple[int, int, int]:
    """How many viewers were more often for the first, for the second, and as often for both, of shares (viewers,)."""
    return int((shares > 0.5).sum()), int((shares < 0.5).sum()), int((shares == 0.5).sum())


def sensitivity(real_called_real: tuple[int, int], fake_called_real: tuple[int, int]) -> float:
    """d': how well real is told from synthetic, 0 where not at all.

    Args:
        real_called_real: how many of the real were called real, and how many there were.
        fake_called_real: the same of the synthetic.

    Returns:
        d', NaN where one of the two was never shown.

    **Source**: Macmillan and Creelman, Detection theory (2005), chapter 1, with the log-linear correction (half an
    answer is added to each cell) of Hautus (1995).
    """
    if not real_called_real[1] or not fake_called_real[1]:
        return _UNKNOWN
    hits, falses = ((yes + 0.5) / (n + 1) for yes, n in (real_called_real, fake_called_real))
    return float(stats.norm.ppf(hits) - stats.norm.ppf(falses))
