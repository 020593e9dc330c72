"""From phones that an aligner heard to tiers that span the recording."""

from collections.abc import Sequence
from itertools import pairwise

from dnnvss.phones import SHORT_PAUSE, SILENCE
from dnnvss.timing import Alignment, Segment, Tier

PAUSE = 0.05
"""Seconds that a silence between two words must last to be a pause of its own."""

CLOSURE = 0.1
"""Seconds of silence before a stop that are taken for its closure."""

STOPS = ("B", "CH", "D", "G", "JH", "K", "P", "T")
"""Phones that begin with a closure."""

Piece = tuple[str, int, float, float]
"""Phone, index of its word (-1 in silence), start and end in seconds."""


def tiers(pieces: Sequence[Piece], words: Sequence[str], duration: float) -> Alignment:
    """Return the tiers ``phones`` and ``words`` from 0 to ``duration``.

    There is ``sil`` at both ends and ``sp`` between words. A silence before a stop and no longer than a closure is part
    of the stop; one that is too short for a pause is shared by its neighbours.

    Args:
        pieces: what was heard, in turn; silences may be missing.
        words: the words.
        duration: end of the recording in seconds.
    """
    spoken = [p for p in pieces if p[1] >= 0]
    edges = [max(spoken[0][2], 0.0)]
    rows: list[tuple[Segment, int]] = []
    if edges[0] > 0.005:
        rows.append((Segment(0.0, edges[0], SILENCE), -1))
    start = edges[0] if rows else 0.0
    for this, following in pairwise([*spoken, None]):
        assert this is not None
        end = min(this[3], duration)
        gap = following[2] - end if following else 0.0
        closure = following is not None and following[0] in STOPS
        if 0 < gap < PAUSE and not closure:
            end += gap / 2
        rows.append((Segment(start, end, this[0]), this[1]))
        if gap >= (CLOSURE if closure else PAUSE) and following:
            rows.append((Segment(end, following[2], SHORT_PAUSE), -1))
            end = following[2]
        start = end
    if duration - start > 0.005:
        rows.append((Segment(start, duration, SILENCE), -1))
    else:
        rows[-1] = (rows[-1][0]._replace(end=duration), rows[-1][1])
    return Alignment([Tier("phones", [s for s, _ in rows]), Tier("words", _spans(rows, words))])


def _spans(rows: Sequence[tuple[Segment, int]], words: Sequence[str]) -> list[Segment]:
    spans: list[Segment] = []
    for k, (segment, word) in enumerate(rows):
        if k and word >= 0 and word == rows[k - 1][1]:
            spans[-1] = spans[-1]._replace(end=segment.end)
        else:
            spans.append(segment._replace(label=words[word] if word >= 0 else ""))
    return spans
