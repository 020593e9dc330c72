"""Viewers whose scores are unlike those of the others, after ITU-R BT.500."""

import numpy as np

FEWEST = 4
"""Viewers that have to have scored a stimulus for it to count."""


def screened(scores: np.ndarray) -> np.ndarray:
    """Which viewers are screened out, (viewers,) bool.

    A score counts as high or low where it is farther from the stimulus's mean than two standard deviations, or the
    root of 20 of them where the kurtosis is outside 2 to 4. A viewer is screened out with more than 5 % of such scores,
    high and low ones in about equal numbers: one who is merely strict or mild is not.

    Args:
        scores: (viewers, stimuli), NaN where a viewer did not score.

    **Source**: Recommendation ITU-R BT.500-15, screening of the observers (P and Q).
    """
    known = ~np.isnan(scores)
    asked = known.sum(axis=0) >= FEWEST
    x, known = scores[:, asked], known[:, asked]
    if not x.shape[1]:
        return np.zeros(len(scores), bool)
    n = known.sum(axis=0)
    off = np.where(known, x - np.where(known, x, 0.0).sum(axis=0) / n, 0.0)
    second, fourth = (off ** 2).sum(axis=0) / n, (off ** 4).sum(axis=0) / n
    kurtosis = np.divide(fourth, second ** 2, out=np.full(len(n), 3.0), where=second > 0)
    factor = np.where((kurtosis >= 2) & (kurtosis <= 4), 2.0, np.sqrt(20.0))
    bound = factor * np.sqrt((off ** 2).sum(axis=0) / (n - 1))
    high = ((off >= bound) & known & (bound > 0)).sum(axis=1)
    low = ((off <= -bound) & known & (bound > 0)).sum(axis=1)
    both, answered = high + low, np.maximum(known.sum(axis=1), 1)
    lopsided = np.abs(high - low) / np.maximum(both, 1)
    return (both / answered > 0.05) & (lopsided < 0.3)
