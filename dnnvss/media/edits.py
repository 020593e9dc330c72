"""When the pictures of a recording that was trimmed without being encoded anew are shown."""

from fractions import Fraction
from itertools import islice
from typing import Any

from dnnvss.media.containers import opened

_BEHIND = 32
"""Packets behind the first one that is shown among which others may be shown before it."""


def hidden(container: Any, number: int) -> Fraction:
    """Seconds from where players begin to the first picture that begins there, beyond what its time stamp says.

    An edit list (phones and QuickTime trim by one) may begin within a picture. The sound is cut there to the sample;
    FFmpeg leaves that picture out and gives its place to the next, which is shown up to a picture later.

    Args:
        container: the recording, whose stamps are those of its edit list.
        number: of the stream among all streams.
    """
    if "mov" not in container.format.name.split(","):
        return Fraction(0)
    with opened(container.name) as edited:
        stamps = _shown(edited, number)
    if not stamps:
        return Fraction(0)
    first = min(stamps, key=lambda place: stamps[place])
    with opened(container.name, {"advanced_editlist": "0"}) as plain:
        stream: Any = plain.streams[number]
        stamp = next((p.pts for p in plain.demux(stream) if p.pos == first and p.pts is not None), stamps[first])
        late = (stamp - stamps[first]) * Fraction(stream.time_base)
    return late if 0 < late < 1 else Fraction(0)


def _shown(container: Any, number: int) -> dict[int, int]:
    """Place in the file and time stamp of the first packets that are shown, none where nothing is hidden before."""
    packets = (p for p in container.demux(container.streams[number]) if p.size and p.pts is not None)
    if (start := next(packets, None)) is None or not start.is_discard:
        return {}
    rest = (p for p in packets if not p.is_discard)
    return {p.pos: p.pts for p in islice(rest, _BEHIND) if p.pos is not None}
