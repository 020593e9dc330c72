"""Utterances of a long recording: words between pauses, as long as a model can use."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

SENTENCE, ANYWHERE, SHORTEST = 0.2, 0.6, 0.1
"""Seconds of a pause that parts utterances: where a sentence ends, anywhere, and where one is too long."""
LONGEST = 12.0
"""Seconds from which an utterance is parted at its longest pause."""
AROUND, WITHIN, CLOSED = 0.3, 0.5, 0.06
"""Seconds of silence that are kept around an utterance at most, by which its edge may lie within what is loud (aligners
find weak sounds late), and of silence within a sound of speech."""
_HOP = 0.01


class Timed(NamedTuple):
    """A word of the text in time: start and end in seconds, and how well it fits (log score a frame)."""

    start: float
    end: float
    score: float


Words = tuple[int, int]
"""The first word of the text and the one behind the last."""


def utterances(words: Sequence[Timed | None], ends: Sequence[bool]) -> list[Words]:
    """Which words make an utterance each.

    Words that have no time are in none. A sentence stays whole, unless it holds a pause of more than 0.6 s or lasts
    longer than 12 s.

    Args:
        words: of the text.
        ends: whether a sentence, a phrase or a line ends after each.
    """
    found: list[Words] = []
    start: int | None = None
    for k, word in enumerate(words):
        if word is None:
            found += _parted(words, (start, k)) if start is not None else []
            start = None
            continue
        before = words[k - 1] if k else None
        if start is not None and before is not None:
            pause = word.start - before.end
            if pause >= (SENTENCE if ends[k - 1] else ANYWHERE):
                found += _parted(words, (start, k))
                start = k
        start = k if start is None else start
    return found + (_parted(words, (start, len(words))) if start is not None else [])


def _parted(words: Sequence[Timed | None], piece: Words) -> list[Words]:
    """A piece, or its parts where it is too long and has pauses."""
    own = [w for w in words[slice(*piece)] if w is not None]
    if own[-1].end - own[0].start <= LONGEST or len(own) < 2:
        return [piece]
    pauses = np.array([b.start - a.end for a, b in pairwise(own)])
    if pauses.max() < SHORTEST:
        return [piece]
    at = piece[0] + int(pauses.argmax()) + 1
    return _parted(words, (piece[0], at)) + _parted(words, (at, piece[1]))


def edges(first: Timed, last: Timed, active: np.ndarray, before: float, behind: float) -> tuple[float, float]:
    """Where an utterance is cut: silence of up to 0.3 s around its words, without breaths, laughter or other speech.

    Args:
        first, last: its first and its last word.
        active: (n,) bool, whether each 10 ms of the recording is louder than silence.
        before, behind: the end of the word before it and the start of the word behind it, in seconds.
    """
    start = max(first.start - _room(active, first.start, -1), (before + first.start) / 2)
    end = min(last.end + _room(active, last.end, 1), (last.end + behind) / 2)
    return start, end


def _room(active: np.ndarray, edge: float, way: int) -> float:
    """Seconds from an edge on, one way, to the end of what is loud there and of the silence that is kept behind it."""
    most, gap = round(AROUND / _HOP), round(CLOSED / _HOP)
    places = round(edge / _HOP) - (way < 0) + way * np.arange(round(WITHIN / _HOP) + most)
    loud = active[places[(places >= 0) & (places < len(active))]]
    reach, k = 0, 0
    while k < min(len(loud), round(WITHIN / _HOP)) and k - reach < gap:
        k += 1
        reach = k if loud[k - 1] else reach
    behind = np.flatnonzero(loud[reach : reach + most])
    return float((reach + (int(behind[0]) if len(behind) else min(most, len(loud) - reach))) * _HOP)
