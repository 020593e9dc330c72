"""Tests on ranks, as the papers print them: signed ranks, Kruskal-Wallis with average ranks and Z, Friedman."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

_EXACT = 12
"""Differences up to which all signs are tried; beyond it the normal distribution is near enough."""


@dataclass(frozen=True)
class SignedRank:
    """A Wilcoxon signed rank test.

    Args:
        count: of all differences (N).
        used: of those that are not zero (n).
        statistic: W, the sum of the ranks of positive differences.
        p: two-sided.
        median: the Hodges-Lehmann estimate: the median of the means of all pairs of differences.
    """

    count: int
    used: int
    statistic: float
    p: float
    median: float


def signed_rank(differences: np.ndarray) -> SignedRank:
    """The Wilcoxon signed rank test of paired differences (N,).

    Up to twelve differences p counts all patterns of signs; beyond it is that of the normal distribution with a
    correction for continuity and for ties.

    **Source**: Theobald et al. (2003), table 2; Hollander and Wolfe, Nonparametric statistical methods (1999),
    section 3.1 and equation 3.23 (estimate).
    """
    d = np.asarray(differences, dtype=float)
    used = d[d != 0]
    upper = np.triu_indices(len(d))
    median = float(np.median((d[upper[0]] + d[upper[1]]) / 2)) if len(d) else float("nan")
    if not len(used):
        return SignedRank(len(d), 0, 0.0, 1.0, median)
    ranks = stats.rankdata(np.abs(used))
    w = float(ranks[used > 0].sum())
    p = _exact_p(ranks, w) if len(used) <= _EXACT else signed_rank_p(w, len(used), _ties(ranks))
    return SignedRank(len(d), len(used), w, p, median)


def signed_rank_p(statistic: float, used: int, ties: float = 0.0) -> float:
    """The two-sided p of W by the normal distribution, with a correction for continuity.

    Args:
        statistic: W, the sum of the ranks of positive differences.
        used: differences that are not zero.
        ties: the sum of t³ - t over groups of t equal ranks.
    """
    variance = used * (used + 1) * (2 * used + 1) / 24 - ties / 48
    off = max(abs(statistic - used * (used + 1) / 4) - 0.5, 0.0)
    return float(2 * stats.norm.sf(off / np.sqrt(variance))) if variance > 0 else 1.0


def _exact_p(ranks: np.ndarray, statistic: float) -> float:
    signs = (np.arange(2 ** len(ranks))[:, None] >> np.arange(len(ranks))) & 1
    sums, middle = signs @ ranks, ranks.sum() / 2
    return float((np.abs(sums - middle) >= abs(statistic - middle) - 1e-9).mean())


def _ties(values: np.ndarray) -> float:
    _, sizes = np.unique(values, return_counts=True)
    return float((sizes.astype(float) ** 3 - sizes).sum())


@dataclass(frozen=True)
class KruskalWallis:
    """A Kruskal-Wallis test, a number of each group in the tuples.

    Args:
        counts: n.
        medians: of the scores.
        ranks: average ranks.
        z: how far each average rank is from that of all, in standard deviations of the null hypothesis.
        statistic: H without a correction for ties, as the papers print it.
        adjusted: H corrected for ties; p is of this.
        p: of equal distributions.
    """

    counts: tuple[int, ...]
    medians: tuple[float, ...]
    ranks: tuple[float, ...]
    z: tuple[float, ...]
    statistic: float
    adjusted: float
    p: float


def kruskal_wallis(groups: Sequence[np.ndarray]) -> KruskalWallis:
    """The Kruskal-Wallis test of two groups of scores or more, none of them empty.

    **Source**: Theobald et al. (2003), tables 3 to 5; Kruskal and Wallis (1952), equations 1.1 and 1.3.
    """
    sizes = np.array([len(g) for g in groups])
    pooled = np.concatenate([np.asarray(g, dtype=float) for g in groups])
    ranks = stats.rankdata(pooled)
    means = np.array([part.mean() for part in np.split(ranks, np.cumsum(sizes)[:-1])])
    h, z = rank_statistics(sizes, means)
    total = len(pooled)
    share = 1 - _ties(pooled) / (total ** 3 - total) if total > 1 else 0.0
    adjusted = h / share if share > 0 else 0.0
    return KruskalWallis(tuple(map(int, sizes)), tuple(float(np.median(g)) for g in groups), tuple(map(float, means)),
                         tuple(map(float, z)), h, adjusted, float(stats.chi2.sf(adjusted, len(groups) - 1)))


def rank_statistics(counts: np.ndarray, ranks: np.ndarray) -> tuple[float, np.ndarray]:
    """H and Z (G,) of groups, from their sizes (G,) and average ranks (G,)."""
    n, total = np.asarray(counts, dtype=float), float(np.sum(counts))
    off = np.asarray(ranks, dtype=float) - (total + 1) / 2
    h = float(12 / (total * (total + 1)) * (n * off ** 2).sum())
    return h, off / np.sqrt(np.maximum((total + 1) * (total / n - 1) / 12, 1e-300))


def leaving_out(groups: Mapping[str, np.ndarray], anchors: Sequence[Sequence[str]]
                ) -> dict[tuple[str, ...], KruskalWallis]:
    """The Kruskal-Wallis test of all groups, and of those that are left without each set of anchors.

    Returns:
        Tests by what was left out, nothing for that of all; sets that leave fewer than two groups are passed over.
    """
    tests = dict[tuple[str, ...], KruskalWallis]()
    for left in [(), *anchors]:
        kept = [scores for name, scores in groups.items() if name not in left]
        if len(kept) > 1:
            tests[tuple(left)] = kruskal_wallis(kept)
    return tests


@dataclass(frozen=True)
class Friedman:
    """A Friedman test: its chi-squared statistic, p, and Kendall's W, the agreement of the blocks (0 to 1)."""

    statistic: float
    p: float
    agreement: float


def friedman(scores: np.ndarray) -> Friedman:
    """The Friedman test of scores (blocks, conditions), corrected for ties; NaN where nothing can be told apart.

    **Source**: Hollander and Wolfe (1999), section 7.1; Kendall's W is the statistic over its greatest value.
    """
    ranks = np.apply_along_axis(stats.rankdata, 1, scores)
    blocks, k = ranks.shape
    spread = ((ranks - (k + 1) / 2) ** 2).sum()
    if blocks < 2 or k < 2 or spread == 0:
        return Friedman(float("nan"), float("nan"), float("nan"))
    off = ranks.sum(axis=0) - blocks * (k + 1) / 2
    statistic = float((k - 1) * (off ** 2).sum() / spread)
    return Friedman(statistic, float(stats.chi2.sf(statistic, k - 1)), statistic / (blocks * (k - 1)))
