"""Phones in their contexts, by name."""

from collections.abc import Iterable

from dnnvss.phones.inventory import SILENCE, SILENCES
from dnnvss.timing import Alignment, Tier


def triphones(phones: Tier) -> list[str]:
    """Return ``left-phone+right`` of every segment; pauses, and what lies beyond the ends, are ``sil``."""
    labels = [SILENCE, *(SILENCE if p in SILENCES else p for p in phones.labels), SILENCE]
    return [f"{a}-{b}+{c}" for a, b, c in zip(labels, labels[1:], labels[2:], strict=False)]


def spoken_triphones(alignments: Iterable[Alignment]) -> list[str]:
    """Return the triphones around spoken phones in the tiers ``phones``, sorted, each once."""
    return sorted({name for a in alignments for name, p in zip(triphones(a["phones"]), a["phones"].labels, strict=True)
                   if p not in SILENCES})


def spoken_seconds(alignments: Iterable[Alignment]) -> float:
    """How many seconds of the tiers ``phones`` are not silence."""
    return float(sum(s.end - s.start for a in alignments for s in a["phones"] if s.label not in SILENCES))
