"""Plain transcripts with times in their lines, as video sites show them and recognisers print them."""

import re
from itertools import pairwise

from dnnvss.formats.cues import Cue

_TIME = r"(?:(\d{1,2}):)?(\d{1,3}):([0-5]\d)(?:[.,](\d{1,3})|[:;]\d\d(?!\d))?"
_LINE = re.compile(rf"\s*[\[(]?{_TIME}(?:\s*(?:-{{1,2}}>|[-\u2013\u2014])\s*{_TIME})?[\])]?"
                   r"(?:\s*[-:\u2013]?\s+(\S.*)|\s*[-:\u2013])?\s*")
_SPEAKER = re.compile(r"\s*[A-Z][^\n\d:]{0,30}\d{0,2}(?:\s{2,}|\s+(?=[\[(]))(?=[\[(]?\d)")
"""Who speaks, before a time of his own (``Speaker 1  0:12``, ``Ann Lee (0:12)``)."""
_SPAN = re.compile(r"^\s*\[[^\]]*\d:\d\d[^\]]*\]")
_START = re.compile(r"\s*[\[(]?0{1,2}:\d\d")
"""A time that nobody says: in the first minute or hour of a recording."""
_LAST = 5.0
"""Seconds that what is said behind the last time is taken to last."""


def stamped_cues(text: str) -> tuple[Cue, ...]:
    """The cues of a text whose lines begin with times (``0:12 text``, ``[00:12] text``, ``[00:12.0 --> 00:15.0] text``,
    or a time above its text, behind the name of who speaks or alone); none where it is not such a text.

    A cue lasts to the next one where its end is not told.
    """
    lines = [line for line in text.split("\n") if line.strip()]
    found: list[tuple[float, float | None, list[str]]] = []
    for line in lines:
        match = _LINE.fullmatch(_SPEAKER.sub("", line, count=1))
        if match is not None:
            start, end = _seconds(match.groups()[:4]), _seconds(match.groups()[4:8])
            found.append((start or 0.0, end, [match[9]] if match[9] else []))
        elif found:
            found[-1][2].append(line.strip())
        else:
            return ()
    starts = [start for start, _, _ in found]
    first = _SPEAKER.sub("", lines[0], count=1) if lines else ""
    if not (len(found) > 1 or _SPAN.match(text) or _START.match(first)) or any(b < a for a, b in pairwise(starts)):
        return ()
    behind = [*starts[1:], starts[-1] + _LAST]
    return tuple(Cue(start, max(start, following if end is None else end), " ".join(words))
                 for (start, end, words), following in zip(found, behind, strict=True) if words)


def _seconds(parts: tuple[str | None, ...]) -> float | None:
    if parts[1] is None:
        return None
    hours, minutes, seconds, fraction = (part or "0" for part in parts)
    return int(hours) * 3600 + int(minutes) * 60 + int(seconds) + int(fraction) / 10 ** len(fraction)
