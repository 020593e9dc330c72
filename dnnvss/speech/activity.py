"""Where somebody speaks in a sound, by its loudness alone: for what needs no phones."""

from itertools import pairwise

import numpy as np

from dnnvss.media import Sound
from dnnvss.phones import SILENCE
from dnnvss.timing import Tier

TIER, SPEECH = "speech", "speech"
"""The tier, and the label of its segments in which somebody speaks; the others are silence."""
_HOP = 0.01
"""Seconds between two looks at the loudness."""
_BELOW, _STILL = 35.0, -65.0
"""Decibels below the loud parts under which nobody speaks, and of full scale under which all is still."""
_LITTLE, _RARE = 0.2, 20.0
"""Seconds of the loudest parts, and decibels by which they stand out of a sound in which hardly anything is said."""
_NOISE = 0.25
"""Share of the way from the quiet to the loud parts under which it is noise that is heard."""
_CLEAR, _SMOOTH, _PAUSE = 0.35, 7, 0.25
"""Share of the way from the quiet to the loud parts of a long recording from which something is said, places of 10 ms
that are looked at together, and seconds from which a gap is a pause."""
_GAP, _BURST, _EDGE = 0.3, 0.05, 0.05
"""Seconds: a shorter gap is a sound of speech, a shorter burst none; and what an edge leaves room for."""


def voice_activity(sound: Sound) -> Tier:
    """The tier ``speech`` of a sound: segments of speech and of silence, from 0 to its end.

    A stretch of 10 ms is speech where it is within 35 dB of the loud parts (the 95th percentile) and
    clearly above the quiet ones (the 10th). Gaps below 0.3 s are filled, bursts below 50 ms left
    out, and speech begins and ends 50 ms before and after. In a sound that is as loud throughout,
    such as speech under noise, all is speech; one below -65 dB of full scale is silent. Where
    hardly anything is said, the loudest 0.2 s, by more than 20 dB, are the loud parts.

    Args:
        sound: of at least one sample.
    """
    level = loudness(sound)
    quiet, loud = np.percentile(level, [10, 95])
    loudest = float(np.sort(level)[-round(_LITTLE / _HOP) :][0])
    if loud - quiet <= 10 and loudest - quiet > _RARE:  # a word in a long silence
        loud = loudest
    if loud < _STILL:
        return Tier(TIER, [(0.0, sound.seconds, SILENCE)])
    least = max(loud - _BELOW, quiet + _NOISE * (loud - quiet)) if loud - quiet > 10 else -np.inf
    heard = _without(level >= least, False, round(_GAP / _HOP))
    heard = _without(heard, True, round(_BURST / _HOP))
    around = round(_EDGE / _HOP)
    heard = np.convolve(heard, np.ones(2 * around + 1), "same") > 0
    cuts = [0, *np.flatnonzero(np.diff(heard)) + 1]
    edges = [*(cut * _HOP for cut in cuts), sound.seconds]
    labels = [SPEECH if heard[cut] else SILENCE for cut in cuts]
    return Tier(TIER, zip(edges[:-1], edges[1:], labels, strict=True))


def louder(level: np.ndarray) -> np.ndarray:
    """Whether each 10 ms (n,) is clearly louder than the noise between words, weak sounds of speech left aside.

    For pauses of a long recording: noise that rises for a moment is none, and a level is one of 70 ms.

    Args:
        level: (n,) decibels of full scale.
    """
    from scipy.ndimage import median_filter  # slow to import

    smooth = median_filter(level, _SMOOTH, mode="nearest")
    quiet, loud = np.percentile(smooth, [10, 98])
    return np.asarray(smooth > max(quiet + _CLEAR * (loud - quiet), _STILL))


def stretches(heard: np.ndarray) -> list[tuple[float, float]]:
    """Start and end in seconds of what is loud (n,) bool, 10 ms a place, between pauses of 0.25 s."""
    mask = _without(_without(heard, False, round(_PAUSE / _HOP)), True, round(_BURST / _HOP))
    cuts = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]))) * _HOP
    return [(float(a), float(b)) for a, b in zip(cuts[::2], cuts[1::2], strict=True)]


def loudness(sound: Sound) -> np.ndarray:
    """Decibels of full scale (n,) of the power of each 10 ms; the last one may be shorter."""
    size = max(1.0, _HOP * sound.rate)  # 220.5 samples at 22050 a second
    starts = (np.arange(-(-len(sound.samples) // size)) * size).astype(int)
    power = np.add.reduceat(np.square(sound.samples, dtype=float), starts)
    counts = np.diff(np.append(starts, len(sound.samples)))
    return 10 * np.log10(power / counts + 1e-12)


def _without(mask: np.ndarray, value: bool, shortest: int) -> np.ndarray:
    """The mask with inner runs of ``value`` that are shorter than so many places turned over."""
    edges = np.flatnonzero(np.diff(mask)) + 1
    made = mask.copy()
    for start, stop in pairwise(edges):
        if mask[start] == value and stop - start < shortest:
            made[start:stop] = not value
    return made
