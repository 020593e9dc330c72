"""How well gestures and units agree with known ones."""

from typing import NamedTuple

import numpy as np
from sklearn.metrics import adjusted_mutual_info_score

from dnnvss.timing import Tier


class BoundaryScores(NamedTuple):
    """Agreement of two sets of boundaries.

    Args:
        precision: share of the found boundaries that have a partner.
        recall: share of the true ones that have.
        f1: their harmonic mean.
        error: mean distance of partners in the unit of the boundaries, NaN where there are none.
    """

    precision: float
    recall: float
    f1: float
    error: float


def boundary_scores(pairs: list[tuple[np.ndarray, np.ndarray]], tolerance: float) -> BoundaryScores:
    """Return how found boundaries agree with true ones, over all pairs of a list together.

    Partners are one to one and at most ``tolerance`` apart; both lists are gone through in order, so that as many
    partners as possible are found. The two ends of an utterance are no boundaries: leave them out.

    Args:
        pairs: (found, true), each sorted, in any one unit.
        tolerance: in that unit.
    """
    distances: list[float] = []
    for found, true in pairs:
        i = j = 0
        while i < len(found) and j < len(true):
            gap = float(found[i] - true[j])
            if abs(gap) <= tolerance:
                distances.append(abs(gap))
            i, j = i + (gap <= tolerance), j + (gap >= -tolerance)
    hits, found_count, true_count = len(distances), sum(len(f) for f, _ in pairs), sum(len(t) for _, t in pairs)
    precision, recall = hits / max(found_count, 1), hits / max(true_count, 1)
    f1 = 2 * hits / max(found_count + true_count, 1)
    return BoundaryScores(precision, recall, f1, float(np.mean(distances)) if distances else float("nan"))


def label_agreement(pairs: list[tuple[Tier, Tier]]) -> float:
    """Return the adjusted mutual information of true labels and the units at the middles of the true segments.

    1 for the same classes under other names, 0 for chance.

    Args:
        pairs: (found, true) tiers.

    **Source**: Vinh, Epps, Bailey, "Information theoretic measures for clusterings comparison", 2010.
    """
    true = [s.label for _, tier in pairs for s in tier]
    found = [tier[tier.index_at((s.start + s.end) / 2)].label for tier, other in pairs for s in other]
    return float(adjusted_mutual_info_score(true, found))
