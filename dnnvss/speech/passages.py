"""Which words of a text are said between which pauses of a recording, told by words that were recognised."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dnnvss.speech.recognise import HeardWord

FEW = 3
"""Words that were not recognised at a pause, up to which it is looked for on which side they are said."""
_WORD, _LEAST, _NONE = 1.5, 0.08, 0.12
"""Seconds that a word takes at most and at least, and that are too few for any."""
_LONGEST = 45.0
"""Seconds beyond which passages are not made one."""

Span = tuple[float, float]
"""Start and end in seconds."""


@dataclass(frozen=True)
class Passage:
    """Words between two pauses.

    Args:
        start, end: seconds from the start of the recording.
        first, last: the words ``first`` to ``last - 1`` of the text.
    """

    start: float
    end: float
    first: int
    last: int

    def joined(self, other: "Passage") -> "Passage":
        """From the start of this one to the end of a later one, with the words between them."""
        return Passage(self.start, other.end, self.first, other.last)


@dataclass(frozen=True)
class _Heard:
    """A stretch of speech, where its first and last words that are known stand in the text and in time."""

    span: Span
    first: int
    last: int
    before: float
    behind: float


def passages(stretches: Sequence[Span], heard: Sequence[HeardWord], places: np.ndarray, good: np.ndarray,
             words: int) -> list[Passage]:
    """The passages of a recording, in order; stretches in which nothing of the text is heard are in none of them.

    Args:
        stretches: where somebody speaks, between pauses.
        heard: what was recognised, on the time line of the recording.
        places: of each heard word, its place in the text, or -1.
        good: whether that is to be trusted.
        words: how many the text has.
    """
    owners = _owners(stretches, heard)
    found: list[Passage] = []
    waiting: list[Span] = []
    last: _Heard | None = None
    for k, span in enumerate(stretches):
        inside = np.flatnonzero((owners == k) & good)
        if not len(inside):
            waiting.append(span)
            continue
        here = _Heard(span, int(places[inside[0]]), int(places[inside[-1]]) + 1, heard[inside[0]].start - span[0],
                      span[1] - heard[inside[-1]].end)
        if last is not None and here.first < last.last:
            continue  # two stretches share a word: the first keeps it
        _add(found, waiting, last, here)
        waiting, last = [], here
    if last is not None and 0 < words - last.last <= FEW and last.behind >= _LEAST * (words - last.last):
        found[-1] = replace(found[-1], last=words)
    return found


def _owners(stretches: Sequence[Span], heard: Sequence[HeardWord]) -> np.ndarray:
    """The stretch (m,) that each heard word shares most time with, -1 where it is in none.

    Not the one around its middle: recognisers let a weak first sound begin in the silence before it.
    """
    starts, ends = (np.array([span[k] for span in stretches]) for k in (0, 1))
    found = np.full(len(heard), -1)
    for k, word in enumerate(heard):
        near = np.arange(np.searchsorted(ends, word.start, "right"), np.searchsorted(starts, word.end))
        if len(near):
            shared = np.minimum(ends[near], word.end) - np.maximum(starts[near], word.start)
            found[k] = near[shared.argmax()]
    return found


def _add(found: list[Passage], waiting: Sequence[Span], last: _Heard | None, here: _Heard) -> None:
    """Add the passage of a stretch, and find a place for the words between it and the one before."""
    done = last.last if last is not None else 0
    lacking = here.first - done
    passage = Passage(*here.span, here.first, here.last)
    if not lacking:
        found.append(passage)
    elif waiting and _fit(lacking, sum(b - a for a, b in waiting)):
        found += [Passage(waiting[0][0], waiting[-1][1], done, here.first), passage]
    elif lacking > FEW or (last is None and here.before < _LEAST * lacking):
        found.append(passage)  # they are not said here
    elif last is None or (last.behind < _NONE and here.before >= _LEAST * lacking):
        found.append(replace(passage, first=done))
    elif here.before < _NONE and last.behind >= _LEAST * lacking:
        found[-1] = replace(found[-1], last=here.first)
        found.append(passage)
    elif passage.end - found[-1].start < _LONGEST:
        found[-1] = found[-1].joined(passage)
    else:
        found.append(passage)


def _fit(words: int, seconds: float) -> bool:
    return _LEAST * words <= seconds <= _WORD * words + 1.0


def widened(found: Sequence[Passage], failed: Sequence[bool]) -> list[tuple[int, int, Passage]]:
    """For runs of passages whose words did not fit, the same made one with their neighbours.

    A word that was taken for one behind a pause spoils the passages on both sides.

    Returns:
        The numbers of the first passage and behind the last one, and what they are together.
    """
    made, k = [], 0
    while k < len(found):
        if not failed[k]:
            k += 1
            continue
        end = k
        while end < len(found) and failed[end]:
            end += 1
        for a, b in ((k, end), (k - 1, end), (k, end + 1), (k - 1, end + 1)):
            if a >= 0 and b <= len(found) and b - a > 1 and found[b - 1].end - found[a].start < _LONGEST:
                made.append((a, b, found[a].joined(found[b - 1])))
        k = end
    return made
