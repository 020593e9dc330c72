"""Null systems that every table needs: they show what a number is worth."""

import numpy as np

from dnnvss.evaluation.bench import Bench, Sentence

SHIFTS = (0.04, 0.08)
"""Seconds."""


def anchors(bench: Bench, seed: int = 0) -> dict[str, dict[str, np.ndarray]]:
    """Return the trajectories of the null systems: name to sentence id to (T, D).

    ``mean`` stands still at the origin of the coefficients, the training mean of the face. ``another sentence`` is the
    measured movement of a random other test sentence, stretched so that speech falls on speech. ``truth + 40 ms`` and
    ``truth + 80 ms`` come late. ``truth`` is the measured parameters themselves; where landmarks were tracked its
    landmark error is what the appearance model cannot express.
    """
    sentences = bench.sentences
    systems = {"mean": {s.id: np.zeros_like(s.reference) for s in sentences}}
    if len(sentences) > 1:
        other = _derangement(len(sentences), seed)
        systems["another sentence"] = {s.id: stretched(sentences[j], s) for s, j in zip(sentences, other, strict=True)}
    for shift in SHIFTS:
        frames = shift * float(bench.clock.rate)
        systems[f"truth + {1000 * shift:.0f} ms"] = {s.id: delayed(s.reference, frames) for s in sentences}
    systems["truth"] = {s.id: s.reference for s in sentences}
    return systems


def delayed(trajectory: np.ndarray, frames: float) -> np.ndarray:
    """Return the trajectory (T, D) delayed by a number of frames; the first frame is held, fractions are
    interpolated."""
    return _sampled(trajectory, np.arange(len(trajectory)) - frames)


def stretched(source: Sentence, target: Sentence) -> np.ndarray:
    """Return the movement of one sentence (T, D) in the time of another: silence on silence, speech on speech."""
    marks = []
    for s in (source, target):
        at = np.flatnonzero(s.speech)
        first, last = (int(at[0]), int(at[-1]) + 1) if len(at) else (0, len(s.speech))
        marks.append([-0.5, first - 0.25, last - 0.75, len(s.speech) - 0.5])
    return _sampled(source.reference, np.interp(np.arange(len(target.reference)), marks[1], marks[0]))


def _sampled(trajectory: np.ndarray, at: np.ndarray) -> np.ndarray:
    at = np.clip(at, 0, len(trajectory) - 1)
    below = np.minimum(at.astype(int), max(len(trajectory) - 2, 0))
    share = (at - below)[:, None]
    above = np.minimum(below + 1, len(trajectory) - 1)
    return (1 - share) * trajectory[below] + share * trajectory[above]


def _derangement(count: int, seed: int) -> np.ndarray:
    """Return a permutation that leaves nothing in its place: a cycle through a random order."""
    order = np.random.default_rng(seed).permutation(count)
    other = np.empty(count, int)
    other[order] = np.roll(order, 1)
    return other
