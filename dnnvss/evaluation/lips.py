"""Do the lips do what the phones ask: closures, contacts, and whether they come at the right time.

All times are counted in frames of one clock; a *closure* is an unbroken run of frames whose aperture is at or below
the closed level. The level is the talker's own: the value that 95 % of the measured p, b and m reach
(:func:`talker_level`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dnnvss.phones import BILABIALS
from dnnvss.timing import FrameClock, Tier

MARGIN = 0.04
"""Seconds by which a phone is widened on both sides before it is searched: alignments are not better than that."""
TALKER_SHARE = 0.95


@dataclass(frozen=True)
class LipEvents:
    """Counts and sums of one sentence; those of several sentences are added.

    Args:
        asked: phones in which the reference reaches the level.
        reached: of these, phones in which the prediction reaches it too.
        predicted: closures of the prediction during speech.
        right: of these, closures during which, give or take the margin, the reference is closed.
        timed: of the reached phones, those at which both sides close during speech (a mouth that was closed before the
            sentence began has no onset).
        onset_error: sum over timed phones of the onset of the prediction less that of the reference, seconds.
        onset_distance: the same, of absolute values.
        least: sum over all phones of the prediction's least value.
        phones: number of phones.
    """

    asked: int = 0
    reached: int = 0
    predicted: int = 0
    right: int = 0
    timed: int = 0
    onset_error: float = 0.0
    onset_distance: float = 0.0
    least: float = 0.0
    phones: int = 0


def talker_level(
    tracks: list[np.ndarray], tiers: list[Tier], clock: FrameClock | Sequence[FrameClock],
    phones: tuple[str, ...] = BILABIALS,
    share: float = TALKER_SHARE, valid: Sequence[np.ndarray] | None = None,
) -> float:
    """Return the value that ``share`` of the talker's phones of a kind reach at their least; NaN where there are none.

    Args:
        tracks: measured apertures (T,), one a sentence.
        tiers: the phones tier of each.
        clock: of the tracks, or of each.
        phones: the labels.
        share: of the phones.
        valid: (T,) bool a sentence, the frames that were measured; phones with others do not count. All where None.
    """
    known = [np.ones(len(t), bool) for t in tracks] if valid is None else valid
    clocks = [clock] * len(tracks) if isinstance(clock, FrameClock) else clock
    least = [track[span].min() for track, tier, rate, own in zip(tracks, tiers, clocks, known, strict=True)
             for span in spans(tier, rate, phones, len(track)) if own[span].all()]
    return float(np.quantile(least, share)) if least else float("nan")


def lip_events(
    reference: np.ndarray,
    predicted: np.ndarray,
    tier: Tier,
    clock: FrameClock,
    level: float,
    speech: np.ndarray | None = None,
    phones: tuple[str, ...] = BILABIALS,
    valid: np.ndarray | None = None,
) -> LipEvents:
    """Return what happened at the phones of one sentence.

    Args:
        reference, predicted: apertures (T,).
        tier: the phones tier.
        clock: of the tracks.
        level: at or below it the lips are closed (or, for f and v, near enough).
        speech: (T,) bool; closures outside it do not count. All frames where None.
        phones: the labels.
        valid: (T,) bool, the frames in which the reference was measured; phones and closures with others in them or in
            their margin do not count. All where None.
    """
    inside = np.ones(len(reference), bool) if speech is None else speech
    asked = reached = 0
    errors: list[float] = []
    searched = [s for s in spans(tier, clock, phones, len(reference)) if valid is None or valid[s].all()]
    for span in searched:
        if reference[span].min() <= level:
            asked += 1
            if predicted[span].min() <= level:
                reached += 1
                own, true = _onset(predicted, span, level), _onset(reference, span, level)
                if inside[max(own - 1, 0)] and inside[max(true - 1, 0)] and min(own, true) > 0:
                    errors.append((own - true) / float(clock.rate))
    margin = clock.edge(MARGIN)
    wide = [slice(max(a - margin, 0), b + margin) for a, b in closures(predicted, level, inside)]
    right = [bool((reference[span] <= level).any()) for span in wide if valid is None or valid[span].all()]
    return LipEvents(
        asked, reached, len(right), sum(right), len(errors), float(np.sum(errors)), float(np.abs(errors).sum()),
        float(sum(predicted[span].min() for span in searched)), len(searched),
    )


def closures(track: np.ndarray, level: float, inside: np.ndarray) -> list[tuple[int, int]]:
    """Return the half-open frame ranges in which a track (T,) is at or below the level, cut to the frames
    ``inside``."""
    closed = np.concatenate([[False], (track <= level) & inside, [False]])
    edges = np.flatnonzero(np.diff(closed.astype(int)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def spans(tier: Tier, clock: FrameClock, phones: tuple[str, ...], frames: int) -> list[slice]:
    """Return the frames of each phone with one of the labels, widened by the margin, one frame at least."""
    found = []
    for segment in tier:
        if segment.label in phones:
            first, last = clock.edges(np.array([segment.start - MARGIN, segment.end + MARGIN]) - tier.start)
            first, last = max(int(first), 0), min(max(int(last), int(first) + 1), frames)
            if first < last:
                found.append(slice(first, last))
    return found


def _onset(track: np.ndarray, span: slice, level: float) -> int:
    """Return the first frame of the closure in which the track is least within the span: the end of an earlier one may
    reach into the span."""
    frame = span.start + int(np.argmin(track[span]))
    while frame > 0 and track[frame - 1] <= level:
        frame -= 1
    return frame
