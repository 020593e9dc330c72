"""Stretches of text with the times at which they are said, in order."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise


@dataclass(frozen=True)
class Cue:
    """A piece of text and when it is said.

    Args:
        start, end: seconds from the start of the recording; both None where they are not known.
        text: one line, never empty.
    """

    start: float | None
    end: float | None
    text: str


def in_order(cues: Iterable[Cue]) -> tuple[tuple[Cue, ...], tuple[str, ...]]:
    """Cues by their start, and what is to be said of how they stood.

    Order of the file is kept where starts are the same. Cues that overlap stay: their times are
    only a hint of where to look.
    """
    given = list(cues)
    known = [cue for cue in given if cue.start is not None]
    if len(known) < len(given):
        return tuple(given), ()
    made = sorted(given, key=lambda cue: cue.start or 0.0)
    notes = []
    if late := sum((b.start or 0.0) < (a.start or 0.0) for a, b in pairwise(given)):
        notes.append(f"{late} cues stood before earlier ones and were put in order")
    if over := sum((b.start or 0.0) < (a.end or 0.0) - _TOUCH for a, b in pairwise(made)):
        notes.append(f"{over} cues begin before the one before them ends")
    return tuple(made), tuple(notes)


_TOUCH = 0.05  # seconds by which cues overlap that only touch
