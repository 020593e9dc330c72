"""Robust statistics: spread by median absolute deviations, which a few values far out cannot move.

A median absolute deviation times 1.4826 is in the scale of a standard deviation: equal to it on normal data.
**Source**: Rousseeuw and Croux, Alternatives to the median absolute deviation, JASA 88(424), 1993, section 1.
"""

import numpy as np

TO_SIGMA = 1.4826
"""A normal distribution's standard deviation in median absolute deviations."""


def spread(centred: np.ndarray) -> np.ndarray:
    """The robust standard deviation of values (N, ...) along their first axis, about zero."""
    return TO_SIGMA * np.median(np.abs(centred), axis=0)


def deviation(values: np.ndarray) -> np.ndarray:
    """The robust standard deviation of values (N, ...) along their first axis, about their median."""
    return spread(values - np.median(values, axis=0))


def robust_limit(values: np.ndarray, deviations: float, least: float = 0.0) -> float:
    """The value (one-sided) that lies ``deviations`` robust standard deviations above the median.

    Args:
        values: what was measured, one number a frame.
        deviations: robust standard deviations.
        least: the limit is not below this, so that data without noise keeps its frames.
    """
    middle = float(np.median(values))
    return max(middle + deviations * TO_SIGMA * float(np.median(np.abs(values - middle))), least)
