"""Contiguous labelled intervals, and the tiers that make an alignment."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.timing.clock import FrameClock

TOLERANCE = 1e-4
"""Seconds by which two edges may differ and still be taken for the same one."""


_LAST = 1e9
"""Seconds that no recording lasts."""


class Segment(NamedTuple):
    """A labelled interval: start and end in seconds, and its label."""

    start: float
    end: float
    label: str

    @property
    def duration(self) -> float:
        """The length in seconds."""
        return self.end - self.start


@dataclass(frozen=True)
class Tier:
    """A row of contiguous segments, ordered in time, without gaps or overlaps.

    **Segments shorter than a frame.** A segment whose two edges round to the same frame edge keeps its place in the
    sequence (its neighbours see it as context) and owns no frame.

    Raises:
        DnnvssError: no segment, a segment that ends before it starts, a gap or an overlap; the message gives the times.
    """

    name: str
    segments: tuple[Segment, ...]

    def __init__(self, name: str, segments: Iterable[tuple[float, float, str]]) -> None:
        object.__setattr__(self, "name", name)
        object.__setattr__(self, "segments", tuple(_joined(name, [Segment(*s) for s in segments])))

    def __len__(self) -> int:
        return len(self.segments)

    def __iter__(self) -> Iterator[Segment]:
        return iter(self.segments)

    def __getitem__(self, index: int) -> Segment:
        return self.segments[index]

    @property
    def labels(self) -> tuple[str, ...]:
        """The label of each segment."""
        return tuple(s.label for s in self.segments)

    @property
    def start(self) -> float:
        """The first edge in seconds."""
        return self.segments[0].start

    @property
    def end(self) -> float:
        """The last edge in seconds."""
        return self.segments[-1].end

    @property
    def edges(self) -> np.ndarray:
        """All edges in seconds, shape (len + 1,)."""
        return np.array([s.start for s in self.segments] + [self.end])

    def frame_edges(self, clock: FrameClock) -> np.ndarray:
        """Return the edges in frames, shape (len + 1,), int64."""
        return clock.edges(self.edges)

    def frame_index(self, clock: FrameClock) -> np.ndarray:
        """Return for each frame the index of the segment that owns it, shape (T,); frame 0 begins at ``start``."""
        return np.repeat(np.arange(len(self)), np.diff(self.frame_edges(clock)))

    def indices_at(self, seconds: np.ndarray) -> np.ndarray:
        """The index (n,) of the segment at each of the times (n,); outside it is the first or the last segment."""
        return np.clip(np.searchsorted(self.edges, seconds, side="right") - 1, 0, len(self) - 1)

    @property
    def middles(self) -> np.ndarray:
        """The middle (len,) of each segment in seconds."""
        edges = self.edges
        return (edges[:-1] + edges[1:]) / 2

    def moved(self, seconds: float) -> "Tier":
        """Return the tier with every edge moved by ``seconds``."""
        return Tier(self.name, [(a + seconds, b + seconds, label) for a, b, label in self.segments])

    def ahead(self, seconds: float) -> "Tier":
        """The tier with every inner edge so many seconds earlier, over the stretch that it spans: what lies beyond its
        ends goes, and the segments at its ends last as much longer."""
        inner = np.clip(self.edges[1:-1] - seconds, self.start, self.end).tolist()
        edges = [self.start, *inner, self.end]
        rows = zip(edges[:-1], edges[1:], self.labels, strict=True)
        return Tier(self.name, [(a, b, label) for a, b, label in rows if b > a])

    def renamed(self, labels: Iterable[str]) -> "Tier":
        """Return the tier with other labels on the same edges."""
        return Tier(self.name, [(s.start, s.end, new) for s, new in zip(self.segments, labels, strict=True)])


def _joined(name: str, segments: list[Segment]) -> list[Segment]:
    if not segments:
        raise DnnvssError(f"tier {name!r} has no segment", remedy="Give at least one segment that spans the utterance")
    joined: list[Segment] = []
    for segment in segments:
        if not (isfinite(segment.start) and isfinite(segment.end) and segment.start < segment.end):
            raise DnnvssError(
                f"tier {name!r}: segment {segment.label!r} runs from {segment.start} to {segment.end} s",
                remedy="Give each segment an end after its start",
            )
        if joined and abs(gap := segment.start - joined[-1].end) > TOLERANCE:
            kind = "gap" if gap > 0 else "overlap"
            raise DnnvssError(
                f"tier {name!r}: {kind} of {abs(gap):.4f} s between {joined[-1].label!r}, which ends at "
                f"{joined[-1].end:.4f} s, and {segment.label!r}, which starts at {segment.start:.4f} s",
                remedy="Make the segments meet; write silence as a segment of its own",
            )
        if joined and segment.start != joined[-1].end:
            segment = segment._replace(start=joined[-1].end)
        if segment.duration <= 0:
            raise DnnvssError(
                f"tier {name!r}: segment {segment.label!r} ends at {segment.end} s, where the one before it ends",
                remedy="Leave the segment out or make it longer",
            )
        joined.append(segment)
    return joined


def _spanning(tier: Tier, start: float, end: float) -> Tier:
    """Return the tier with its first and last edge put in place, itself if they are."""
    if (tier.start, tier.end) == (start, end):
        return tier
    edges = [start, *tier.edges[1:-1].tolist(), end]
    return Tier(tier.name, zip(edges[:-1], edges[1:], tier.labels, strict=True))


@dataclass(frozen=True)
class Alignment:
    """Tiers over the same stretch of time.

    The package reads the tiers ``phones`` and ``words``, and ``visemes`` (dynamic visemes) where present. In ``words``
    a pause has the label ``""``. Tiers that start or end apart by no more than :data:`TOLERANCE` are made to span what
    the first one spans, so that all of them have the same number of frames at any rate.

    Raises:
        DnnvssError: no tier, two tiers of one name, or tiers that start or end apart.
    """

    tiers: tuple[Tier, ...]

    def __init__(self, tiers: Iterable[Tier]) -> None:
        object.__setattr__(self, "tiers", tuple(tiers))
        names = [t.name for t in self.tiers]
        if not names or len(set(names)) != len(names):
            raise DnnvssError(f"an alignment needs tiers of different names, got {names}", remedy="Name each tier once")
        first = self.tiers[0]
        for tier in self.tiers[1:]:
            if abs(tier.start - first.start) > TOLERANCE or abs(tier.end - first.end) > TOLERANCE:
                raise DnnvssError(
                    f"tier {tier.name!r} spans {tier.start:.4f} to {tier.end:.4f} s, tier {first.name!r} "
                    f"{first.start:.4f} to {first.end:.4f} s",
                    remedy="Let all tiers span the whole utterance; pad with silence",
                )
        object.__setattr__(self, "tiers", (first, *(_spanning(t, first.start, first.end) for t in self.tiers[1:])))

    def __contains__(self, name: str) -> bool:
        return any(t.name == name for t in self.tiers)

    def __getitem__(self, name: str) -> Tier:
        for tier in self.tiers:
            if tier.name == name:
                return tier
        raise DnnvssError(f"no tier {name!r} among {[t.name for t in self.tiers]}", remedy=f"Add a tier {name!r}")

    @property
    def start(self) -> float:
        """The first edge in seconds."""
        return self.tiers[0].start

    @property
    def end(self) -> float:
        """The last edge in seconds."""
        return self.tiers[0].end

    def with_tier(self, tier: Tier) -> "Alignment":
        """Return the alignment with ``tier`` added, or put in place of the one with its name."""
        return replace(self, tiers=(*[t for t in self.tiers if t.name != tier.name], tier))

    def to_json(self) -> dict[str, Any]:
        """Return plain containers: tier name to ``{"edges": [...], "labels": [...]}``."""
        return {t.name: {"edges": [round(float(e), 6) for e in t.edges], "labels": list(t.labels)} for t in self.tiers}

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "Alignment":
        """The alignment that :meth:`to_json` described.

        Raises:
            DnnvssError: a tier without as many labels as its edges enclose, or with other values.
        """
        return cls(_tier_of(name, tier) for name, tier in value.items())


def _tier_of(name: Any, value: Any) -> Tier:
    held = (value.get("edges"), value.get("labels")) if isinstance(value, dict) else (None, None)
    edges, labels = (part if isinstance(part, list) else [] for part in held)
    times = all(type(edge) in (int, float) and abs(edge) < _LAST for edge in edges)
    if not times or len(edges) != len(labels) + 1 or not all(isinstance(x, str) for x in (name, *labels)):
        raise DnnvssError(f"tier {str(name)[:40]!r} is not edges in seconds and the labels between them")
    return Tier(name, zip(edges[:-1], edges[1:], labels, strict=True))
