"""How near the lips in one video are to those in another: what is told of a system that is judged from outside."""

from dataclasses import dataclass

import numpy as np

from dnnvss.evaluation.lips import closures
from dnnvss.evaluation.metrics import correlation
from dnnvss.evaluation.outside.lips import NAMES, Lips
from dnnvss.timing import FrameClock, Tier

NEAR = 0.04
"""Seconds within which a closure counts as found."""

MEASURES = {
    **{f"{name} r": f"Pearson's correlation of the {name} over speech, in both videos as the tracker sees it; mean "
                    "over the sentences." for name in NAMES},
    "closures found": f"Share of the talker's closures during speech, of whatever phone, at which the lips of the "
                      f"other video are closed within {1000 * NEAR:.0f} ms.",
    "closures right": "Share of the other video's closures during speech at which the talker's lips are closed as "
                      "near.",
    "variance": "Variance of the aperture over speech against the talker's; mean over the sentences.",
}
"""Name of each measure and its definition, in the order of the table."""


@dataclass(frozen=True)
class Watched:
    """What a sentence's videos are measured by.

    Args:
        speech: frames (F,) bool from the first phone to the last.
        level: aperture at and below which the tracker sees closed lips.
        clock: of the frames.
    """

    speech: np.ndarray
    level: float
    clock: FrameClock


def scores(truth: Lips, made: Lips, watched: Watched) -> dict[str, tuple[float, float]]:
    """Each of :data:`MEASURES` as amount and weight; weight 0 where nothing could be measured.

    Args:
        truth: of the talker's own video.
        made: of the other one, as many frames.
        watched: what is measured by.
    """
    inside = watched.speech & truth.seen & made.seen
    r, m = truth.tracks[inside], made.tracks[inside]
    if len(r) < 3:
        return dict.fromkeys(MEASURES, (0.0, 0.0))
    found = {f"{name} r": _known(float(value)) for name, value in zip(NAMES, correlation(r, m), strict=True)}
    spread = float(r[:, 0].var())
    return {**found,
            "closures found": _share(truth, made, inside, watched),
            "closures right": _share(made, truth, inside, watched),
            "variance": _known(float(m[:, 0].var()) / spread if spread > 0 else float("nan"))}


def _share(asked: Lips, other: Lips, inside: np.ndarray, watched: Watched) -> tuple[float, float]:
    """Closures in one video at which the lips of the other are closed, and their number; those beside frames in which
    the other's lips were not seen do not count."""
    near = watched.clock.edge(NEAR)
    spans = [slice(max(a - near, 0), b + near) for a, b in closures(asked.tracks[:, 0], watched.level, inside)]
    met = [bool((other.tracks[span, 0] <= watched.level).any()) for span in spans if other.seen[span].all()]
    return float(sum(met)), float(len(met))


def _known(value: float) -> tuple[float, float]:
    return (0.0, 0.0) if np.isnan(value) else (value, 1.0)


def laid_over(own: Tier, tier: Tier, clock: FrameClock, frames: int) -> np.ndarray | None:
    """Where in one video each frame of another is that says the same words at other times: frames with fractions (F,).

    Time goes evenly between the edges of words.

    Args:
        own: words of the first video.
        tier: words of the other video.
        clock: of both.
        frames: of the other video.

    Returns:
        None where the words are not the same.
    """
    here, there = _spoken(own), _spoken(tier)
    if [word for word, *_ in here] != [word for word, *_ in there] or not here:
        return None
    edges = [np.array([edge for _, *span in spans for edge in span]) for spans in (there, here)]
    theirs, ours = edges[0] - tier.start, edges[1] - own.start
    kept = np.concatenate([[True], np.diff(theirs) > 1e-9])
    moments = np.interp(clock.centres(frames), theirs[kept], ours[kept])
    return moments * float(clock.rate) - 0.5


def _spoken(tier: Tier) -> list[tuple[str, float, float]]:
    return [(s.label.lower(), s.start, s.end) for s in tier if s.label]
