"""What a long recording's text and sound have in common, what they have not, and whether given times keep to it."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np

from dnnvss.speech.passages import Passage
from dnnvss.speech.utterances import Timed

Words = list[Timed | None]
"""When each word of a text is said, None where that was not found."""

FAR, LATE, DRIFT = 3.0, 0.5, 0.002
"""Seconds beyond which a word is not the one that was meant; seconds, and share, from which it is told that times are
late and that they drift."""
LONG = 60.0
"""Seconds of given times below which nothing is said of their drift."""
_SHORT = 0.6
"""Seconds of speech that are not listed where the text has none."""
_LINE = 300  # words by which the line is found


class LeftOut(NamedTuple):
    """A part of a recording that is not used: the recording, start and end in seconds, and why."""

    recording: str
    start: float
    end: float
    why: str


def fitted(rows: Iterable[Sequence[float]]) -> Words:
    """Words in time, of plain rows."""
    return [Timed(start, end, score) for start, end, score in rows]


def off_line(words: Sequence[Timed | None], given: Sequence[tuple[float, float] | None]) -> tuple[list[int], list[str]]:
    """Words that were found far from where they should be, and what is to be told of the given times.

    Given times may be late and may drift, by a line that most words tell; a word that is off it by more than 3 s and
    the length of its cue was heard in another place.
    """
    from scipy.stats import theilslopes  # slow to import, and short recordings need none of it

    both = [(k, g[0], w.start, g[1]) for k, (w, g) in enumerate(zip(words, given, strict=True))
            if w is not None and g is not None]
    if len(both) < 10:
        return [], []
    places, wanted, found, loose = (np.array(column) for column in zip(*both, strict=True))
    some = np.unique(np.linspace(0, len(both) - 1, min(_LINE, len(both))).astype(int))
    slope, start = theilslopes(found[some] - wanted[some], wanted[some])[:2]
    off = found - wanted - (start + slope * wanted)
    far = np.abs(off) > FAR + loose
    notes = []
    late = float(np.median(found - wanted))
    if abs(late) > LATE:
        notes.append(f"its times are {abs(late):.1f} s {'early' if late > 0 else 'late'} and were put right")
    if abs(slope) > DRIFT and np.ptp(wanted) > LONG:
        notes.append(f"its times drift by {100 * abs(slope):.1f} % against the sound and were put right")
    if far.any():
        notes.append(f"{int(far.sum())} words were heard more than {FAR:g} s from their times and were left out")
    return [int(k) for k in places[far]], notes


def left_out(recording: str, text: Sequence[str], words: Sequence[Timed | None], passages: Sequence[Passage],
             failed: Mapping[int, str], spans: Sequence[tuple[float, float]]) -> list[LeftOut]:
    """What was not used of a recording and its text, in order.

    Args:
        recording: its name.
        text: the words of its text.
        words: when each is said.
        passages: between pauses.
        failed: why a passage is not used, by its number.
        spans: where somebody speaks, or something sounds.
    """
    found = [LeftOut(recording, passages[k].start, passages[k].end, why) for k, why in failed.items()]
    found += [LeftOut(recording, a, b, "something sounds that the text does not have: noise, music, laughter, or words "
                      "that it leaves out") for a, b in _other(spans, passages)]
    tried = {w for k in failed for w in range(passages[k].first, passages[k].last)}
    lost = [k for k, word in enumerate(words) if word is None and k not in tried]
    for _, run in groupby(enumerate(lost), lambda pair: pair[1] - pair[0]):
        places = [k for _, k in run]
        before = max((w.end for w in words[: places[0]] if w is not None), default=0.0)
        behind = next((w.start for w in words[places[-1] :] if w is not None), spans[-1][1] if spans else before)
        said = " ".join(text[places[0] : places[-1] + 1])
        found.append(LeftOut(recording, before, behind, f"{len(places)} words are not said where they should be: "
                             f"{said if len(said) < 80 else said[:77] + '...'!r}"))
    return sorted(found, key=lambda part: part[1])


def _other(spans: Sequence[tuple[float, float]], passages: Sequence[Passage]) -> list[tuple[float, float]]:
    """Where something sounds outside all passages; close ones made one."""
    found: list[tuple[float, float]] = []
    for start, end in spans:
        if any(p.start < end and start < p.end for p in passages):
            continue
        if found and start - found[-1][1] < 1.0 and not any(found[-1][1] <= p.start < start for p in passages):
            found[-1] = found[-1][0], end
        else:
            found.append((start, end))
    return [(a, b) for a, b in found if b - a >= _SHORT]
