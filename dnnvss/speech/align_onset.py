"""How long a phone lasts behind a silence at most: a weak sound or a closure swallows no silence.

Where speech begins, an aligner cannot tell the closure of a stop from silence, takes the smack of lips that open for
its burst, and hears a weak sound in the noise before it. Within speech the same phones are held by their neighbours:
what they last there tells how long they can last behind a silence.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from dnnvss.phones import SILENCES
from dnnvss.speech.align_tiers import STOPS
from dnnvss.timing import Alignment, Segment, Tier

QUANTILE, FREE, EXAMPLES = 99.0, 1.25, 10
"""Percentile of what a phone lasts between others, by how much more it may last behind a silence, and how often it must
have been between others to tell."""

CLOSED = 0.2
"""Seconds that a stop lasts behind a silence at most where its talker does not tell: a closure and its burst."""

Run = tuple[str, float, float]
"""Phone or silence, start and end."""


def longest(clips: Sequence[Sequence[Run]]) -> dict[str, float]:
    """Seconds, or whatever the runs are in, that a phone lasts behind a silence at most.

    Phones that are between others less than 10 times are left out.

    Args:
        clips: the runs of each, in turn.
    """
    lasts: dict[str, list[float]] = {}
    for runs in clips:
        for before, (label, start, end), behind in zip(runs, runs[1:], runs[2:], strict=False):
            if not {before[0], label, behind[0]} & set(SILENCES):
                lasts.setdefault(label, []).append(end - start)
    return {label: FREE * float(np.percentile(d, QUANTILE)) for label, d in lasts.items() if len(d) >= EXAMPLES}


def runs_of(alignment: Alignment) -> list[Run]:
    """The phones and silences of an alignment, in seconds."""
    return [(s.label, s.start, s.end) for s in alignment["phones"]]


def limit_of(phone: str, limits: Mapping[str, float]) -> float:
    """Seconds that a phone lasts behind a silence at most; infinite where nothing tells."""
    return limits.get(phone, CLOSED if phone in STOPS else np.inf)


def given_back(alignment: Alignment, limits: Mapping[str, float]) -> Alignment:
    """Tiers ``phones`` and ``words`` in which no phone lasts longer behind a silence than it may.

    The start of the phone, and of its word, moves towards its end, and the silence becomes longer.

    Args:
        alignment: as an aligner heard it.
        limits: as :func:`longest` gives them.
    """
    moved: dict[float, float] = {}
    for before, phone in pairwise(alignment["phones"]):
        if before.label in SILENCES and phone.label not in SILENCES:
            start = phone.end - limit_of(phone.label, limits)
            moved |= {phone.start: start} if start > phone.start else {}

    def edited(tier: Tier) -> Tier:
        return Tier(tier.name, [Segment(moved.get(s.start, s.start), moved.get(s.end, s.end), s.label) for s in tier])

    return Alignment([edited(alignment["phones"]), edited(alignment["words"])]) if moved else alignment
