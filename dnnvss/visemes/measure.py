"""How well gestures and units agree with known ones."""

from typing import NamedTuple

import numpy as np

from dnnvss.timing import FrameClock, Tier


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


class UnitScores(NamedTuple):
    """How well predicted dynamic visemes agree with those cut from the video.

    Args:
        frames: share of the frames in which the unit is right.
        moving: the same over the frames in which the face does not rest.
        sequence: ``1 - edits / units``: how many units must be put in, left out or exchanged, times left aside.
        f1: boundary F1 by tolerance in frames.
        error: mean distance from each true boundary to the nearest predicted one, in milliseconds.
    """

    frames: float
    moving: float
    sequence: float
    f1: dict[int, float]
    error: float


def unit_scores(pairs: list[tuple[Tier, Tier]], clock: FrameClock, tolerances: tuple[int, ...] = (1, 2, 4, 8),
                rest: str = "0") -> UnitScores:
    """Return how found tiers ``visemes`` agree with true ones, over all utterances together.

    Args:
        pairs: (found, true), spanning the same time.
        clock: of the frames.
        tolerances: frames.
        rest: the unit in which the face rests.
    """
    right, moving, edits, distances = [], [], 0, []
    edges = []
    for found, true in pairs:
        at = [np.array(t.labels)[t.frame_index(clock)] for t in (found, true)]
        right.append(at[0] == at[1])
        moving.append(at[1] != rest)
        edits += _edit_distance(found.labels, true.labels)
        inner = [t.frame_edges(clock)[1:-1].astype(float) for t in (found, true)]
        edges.append((inner[0], inner[1]))
        if len(inner[0]):
            distances.append(np.abs(inner[1][:, None] - inner[0]).min(axis=1))
    hit, mask = np.concatenate(right), np.concatenate(moving)
    error = float(np.concatenate(distances).mean()) * 1000 / float(clock.rate) if distances else float("nan")
    return UnitScores(float(hit.mean()), float(hit[mask].mean()) if mask.any() else float("nan"),
                      1 - edits / sum(len(true) for _, true in pairs),
                      {n: boundary_scores(edges, n).f1 for n in tolerances}, error)


def _edit_distance(found: tuple[str, ...], true: tuple[str, ...]) -> int:
    """Return how many labels must be put in, left out or exchanged. **Source**: Levenshtein, 1966."""
    row = list(range(len(true) + 1))
    for i, a in enumerate(found, 1):
        before, row[0] = row[0], i
        for j, b in enumerate(true, 1):
            before, row[j] = row[j], min(row[j] + 1, row[j - 1] + 1, before + (a != b))
    return row[-1]


def label_agreement(pairs: list[tuple[Tier, Tier]]) -> float:
    """Return the adjusted mutual information of true labels and the units at the middles of the true segments.

    1 for the same classes under other names, 0 for chance.

    Args:
        pairs: (found, true) tiers.

    **Source**: Vinh, Epps, Bailey, "Information theoretic measures for clusterings comparison", 2010.
    """
    true = [s.label for _, tier in pairs for s in tier]
    found = [tier[i].label for tier, other in pairs for i in tier.indices_at(other.middles)]
    from sklearn.metrics import adjusted_mutual_info_score  # slow to import, and synthesis needs none of it

    return float(adjusted_mutual_info_score(true, found))
