"""Whether the times of an alignment that was given are those of its sound."""

from collections.abc import Sequence

import numpy as np

from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.phones import SILENCES
from dnnvss.speech.align import align
from dnnvss.speech.align_doubt import Word, levels
from dnnvss.timing import Alignment, Tier

OUTSIDE, COVERED = 0.08, 0.9
"""Share of loud sound outside the speech of an alignment, and of it in its phones, from which the aligner is asked.

Of right alignments of five talkers 95 % have 0.08 at most and 0.88 at least (GRID's s1: 0.25 and 0.74); half of those
that are 0.3 s early have 0.05 and more, and 0.85 and less; all that are half as long, 0.39 and 0.45."""
APART = 0.12
"""Seconds by which words start beside where the aligner hears them, in the median, from which times are wrong."""
_LOUD, _NEAR = 15.0, 0.15
"""Decibels below the loudest in which sound is loud, and seconds round speech that are not outside of it."""


def said_in(sound: np.ndarray, words: Sequence[Word]) -> Alignment | None:
    """Where words are said in a sound (n,) at 16 kHz; None where the aligner for everybody does not find them in it."""
    try:
        return align(sound, words, sharp=False).alignment
    except ShortageError:
        raise
    except DnnvssError:
        return None


def suspicious(phones: Tier, sound: np.ndarray) -> bool:
    """Whether much of what is loud in a sound (n,) at 16 kHz is no speech by a tier of phones."""
    level = levels(sound)
    spoken = [s for s in phones if s.label not in SILENCES]
    if not len(level) or not spoken:
        return False
    at = (np.arange(len(level)) + 0.5) / 100
    loud = level > np.percentile(level, 95) - _LOUD
    inside = np.array([s.label not in SILENCES for s in phones])[phones.indices_at(at)]
    outside = (at < spoken[0].start - _NEAR) | (at > spoken[-1].end + _NEAR)
    count = max(int(loud.sum()), 1)
    return bool((loud & outside).sum() / count > OUTSIDE or (loud & inside).sum() / count < COVERED)


def seconds_off(given: Alignment, heard: Alignment) -> float:
    """By how many seconds words start beside where they are heard, in the median; ends of speech where words differ."""
    a, b = ([s for s in tier if s.label] for tier in (given["words"], heard["words"]))
    if len(a) == len(b):
        return float(np.median([abs(x.start - y.start) for x, y in zip(a, b, strict=True)]))
    return max(abs(a[0].start - b[0].start), abs(a[-1].end - b[-1].end)) if a and b else 0.0
