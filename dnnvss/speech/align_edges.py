"""Edges between phones moved to where the sound changes most nearby."""

from itertools import pairwise

import numpy as np

from dnnvss.speech.align_features import HOP, cepstra
from dnnvss.timing import Alignment, Tier

REACH = 0.03
"""Seconds by which an edge may move."""

_SPAN = 0.08
"""Seconds of sound on either side that are compared, within the two phones."""

_TRUST = 6.0
"""What it costs to move an edge by 10 ms (by the square of the distance), in squared standard deviations of a frame."""

_KEPT = 0.3
"""Share of a phone that an edge leaves to it."""

_ROUNDS = 2

_STATIC = 13
"""Cepstra without their slopes, which look across an edge."""


def sharpened(alignment: Alignment, audio: np.ndarray) -> Alignment:
    """Return the tiers ``phones`` and ``words`` with their inner edges where the sound changes.

    An aligner's edges lie on its 10 ms frames and lean to one side between some kinds of phones. Each edge moves to
    where two Gaussians, one for the sound before and one for the sound behind it, explain what is near it best (the
    generalised likelihood ratio), less a penalty for the distance. Nothing is learnt: the sound itself decides.

    The constants were chosen on sentences other than those of docs/results/timing.md; the error is flat about them.

    Args:
        alignment: what an aligner heard.
        audio: the recording (n,) at 16 kHz.

    **Source**: H. Gish, M.-H. Siu and R. Rohlicek, "Segregation of speakers for speech recognition and speaker
        identification", ICASSP 1991 (the ratio).
    """
    features = cepstra(audio)[:, :_STATIC].astype(float)
    features /= np.maximum(features.std(axis=0), 1e-6)
    before = alignment["phones"].edges
    edges = before
    for _ in range(_ROUNDS):
        edges = _moved(features, edges, before)
    words = alignment["words"]
    own = np.abs(words.edges[:, None] - before).argmin(axis=1)  # the edge of a phone that each edge of a word is
    return Alignment([_with(alignment["phones"], edges), _with(words, edges[own])])


def _with(tier: Tier, edges: np.ndarray) -> Tier:
    return Tier(tier.name, [(float(a), float(b), label) for (a, b), label in zip(pairwise(edges), tier.labels,
                                                                                strict=True)])


def _moved(features: np.ndarray, edges: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Return the edges (n,), each moved between its neighbours; the first and last stay."""
    moved = edges.copy()
    for k, (start, here, end) in enumerate(zip(edges[:-2], edges[1:-1], edges[2:], strict=True), start=1):
        low = max(start + _KEPT * (here - start), before[k] - REACH, moved[k - 1] + HOP)
        high = min(end - _KEPT * (end - here), before[k] + REACH)
        first, last = (round(t / HOP) for t in (max(start, here - _SPAN), min(end, here + _SPAN)))
        places = np.arange(int(np.ceil(low / HOP)), int(high / HOP) + 1)
        places = places[(places >= first + 2) & (places <= min(last, len(features)) - 2)]
        if len(places):
            cost = _scatter(features[first:last], places - first) + _TRUST * ((places * HOP - before[k]) / 0.01) ** 2
            moved[k] = np.clip((places[cost.argmin()] + _vertex(cost)) * HOP, low, high)
    return moved


def _scatter(frames: np.ndarray, cuts: np.ndarray) -> np.ndarray:
    """Return for each cut (C,) of frames (n, 13) the squared distance of both parts from their means."""
    sums = np.cumsum(frames, axis=0)
    left, right = sums[cuts - 1], sums[-1] - sums[cuts - 1]
    explained = (left**2).sum(axis=1) / cuts + (right**2).sum(axis=1) / (len(frames) - cuts)
    return np.asarray((frames**2).sum() - explained)


def _vertex(cost: np.ndarray) -> float:
    """Return how far the vertex of the parabola about the least cost lies from it, in places (at most half a one)."""
    k = int(cost.argmin())
    if not 0 < k < len(cost) - 1:
        return 0.0
    before, least, after = cost[k - 1 : k + 2]
    bend = before - 2 * least + after
    return float(0.5 * (before - after) / bend) if bend > 0 else 0.0
