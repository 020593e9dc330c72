"""Tiers of segments that carry one code each: their arrays, and the blocks that phones and dynamic visemes share.

Per frame there is a code and the index of the segment that owns it; everything else is kept once a segment or once an
utterance. No array depends on the choice of blocks.
"""

import weakref
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from dnnvss.features.block import Block, at_offsets, binary, numeric, table_1
from dnnvss.features.fields import Field
from dnnvss.features.view import View

THIRDS = ("start", "middle", "end")
_NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


@dataclass(frozen=True)
class Units:
    """What the segments of a tier are.

    Args:
        name: of one unit, and of its arrays and axis.
        source: of features.
        paper: what Thangthai 2016 calls it.
        names: of the units, by code.
        dtype: of a code.
        outside: the code that stands outside the utterance; None where nothing does.
        beyond: what that is, in words.
    """

    name: str
    source: str
    paper: str
    names: tuple[str, ...]
    dtype: type
    outside: int | None = None
    beyond: str = "nothing"


def thirds(index: Any, count: Any) -> Any:
    """0, 1 or 2 for the start, middle or end third in which place ``index`` of ``count`` has its centre.

    ``floor(3 (index + 1/2) / count)``, exact in integers: one place is the middle, two are start and end, three are
    start, middle and end.
    """
    return 3 * (2 * index + 1) // (2 * count)


def segment_fields(name: str, dtype: type) -> dict[str, Field]:
    """The arrays of a tier. ``*_start`` is the first row on the axis it points to; ``*_frames`` and the like count."""
    return {
        name: Field("frame", dtype),
        f"{name}_segment": Field("frame", np.int32, points_to=name),
        f"{name}_code": Field(name, dtype),
        f"{name}_start": Field(name, np.int32, points_to="frame"),
        f"{name}_frames": Field(name, np.uint16),
        f"{name}_utterance": Field(name, np.int32, points_to="utterance"),
        f"utterance_{name}_start": Field("utterance", np.int32, points_to=name),
        f"utterance_{name}s": Field("utterance", np.int32),
    }


def segment_arrays(name: str, codes: np.ndarray, edges: np.ndarray) -> dict[str, Any]:
    """The arrays of one utterance's tier whose segments have these codes (S,) and frame edges (S + 1,)."""
    owner = np.repeat(np.arange(len(codes)), np.diff(edges))
    return {
        name: codes[owner], f"{name}_segment": owner, f"{name}_code": codes, f"{name}_start": edges[:-1],
        f"{name}_frames": np.diff(edges), f"{name}_utterance": np.zeros(len(codes)),
        f"utterance_{name}_start": [0], f"utterance_{name}s": [len(codes)],
    }  # fmt: skip


@dataclass(frozen=True)
class Track:
    """One tier at a batch of frames; every array has the shape (B,) and is int64 unless it says otherwise.

    Args:
        view: the batch that it belongs to.
        name: of the units.
    """

    view: View
    name: str

    def of_segment(self, name: str) -> Any:
        """The rows of an array that belong to the segments, int64 (B, ...); gathered once a batch."""
        if name not in self.view.gathered:
            self.view.gathered[name] = self.view.wide(name, self.segment)
        return self.view.gathered[name]

    @cached_property
    def segment(self) -> Any:
        """Index of the segment that owns the frame."""
        return self.view.wide(f"{self.name}_segment", self.view.frames)

    @cached_property
    def code(self) -> Any:
        """Unit code of the frame."""
        return self.view.wide(self.name, self.view.frames)

    @cached_property
    def elapsed(self) -> Any:
        """Frames of the segment that came before this one."""
        return self.view.frames - self.of_segment(f"{self.name}_start")

    @cached_property
    def frames(self) -> Any:
        """Frames of the segment."""
        return self.of_segment(f"{self.name}_frames")

    @cached_property
    def utterance(self) -> Any:
        """Index of the utterance."""
        return self.of_segment(f"{self.name}_utterance")

    @cached_property
    def segment_bounds(self) -> tuple[Any, Any]:
        """First segment of the utterance, and the one after its last."""
        start = self.view.wide(f"utterance_{self.name}_start", self.utterance)
        return start, start + self.view.wide(f"utterance_{self.name}s", self.utterance)

    @cached_property
    def frame_bounds(self) -> tuple[Any, Any]:
        """First frame of the utterance, and the one after its last."""
        return self.view.frame_bounds(self.utterance)


def track(view: View, name: str) -> Track:
    """A tier at the frames of a batch, made once a batch."""
    if name not in view.tracks:
        view.tracks[name] = Track(weakref.proxy(view), name)  # no circle: a batch's arrays are gone with its view
    return view.tracks[name]


def unit_blocks(units: Units, offsets: tuple[int, ...], neighbours: tuple[int, ...]) -> list[Block]:
    """The blocks that all units have in common.

    Args:
        units: of the tier.
        offsets: frames of the window, relative to the current one.
        neighbours: places of the segment context, relative to its middle one.
    """
    unit, names, reads = units.name, units.names, (units.source,)
    window = "phonetic" if units.paper == "phoneme" else units.paper
    number = table_1(f"frame: position and number of frames in {units.paper}")
    reach = _NUMBERS[max(neighbours)]
    beside = f", {reach} before and {reach} after; {units.beyond} outside the utterance" if max(neighbours) else ""
    return [
        binary(f"centre_{unit}", "frame", reads, table_1(f"frame: centre {units.paper}"), f"the {unit} of this frame",
               names, 1, partial(centre, unit)),
        binary(f"{unit}_window", "frame", reads, table_1(f"frame: {window} window context"),
               f"the {unit} at each frame around; {units.beyond} outside the utterance", at_offsets(offsets, names),
               max(len(offsets), 1), partial(window_of, units, offsets)),
        binary(f"{unit}_position", "frame", reads, number,
               f"the third of the {unit} in which this frame has its centre", THIRDS, 1, partial(position, unit)),
        numeric(f"{unit}_frames", "frame", reads, "frames", number, f"frames in the {unit}", ("frames",),
                partial(frames, unit)),
        numeric(f"{unit}_span", "frame", reads, "frames", table_1(f"frame: forward {units.paper} span"),
                f"frames until the {unit} changes, this one included", ("frames",), partial(span, unit)),
        binary(f"{unit}_context", "segment", reads, table_1(f"segment: {units.paper} context"),
               f"the {unit}{beside}", at_offsets(neighbours, names), len(neighbours),
               partial(context, units, neighbours)),
    ]


def fraction_block(units: Units) -> Block:
    """The place of the frame in its segment as one number."""
    unit = units.name
    return numeric(f"{unit}_fraction", "frame", (units.source,), "share of the segment", "ours",
                   f"where in the {unit} this frame's centre lies, 0 to 1", ("fraction",), partial(fraction, unit))


def centre(unit: str, view: View, start: int, pad: int) -> Any:
    """The unit of this frame."""
    return track(view, unit).code[:, None] + start


def position(unit: str, view: View, start: int, pad: int) -> Any:
    """The third of the segment in which this frame lies."""
    at = track(view, unit)
    return thirds(at.elapsed, at.frames)[:, None] + start


def window_of(units: Units, offsets: tuple[int, ...], view: View, start: int, pad: int) -> Any:
    """The unit at each frame of the window."""
    around = view.around(units.name, view.frames, offsets, track(view, units.name).frame_bounds)
    return _spread(units, view, *around, start, pad)


def context(units: Units, offsets: tuple[int, ...], view: View, start: int, pad: int) -> Any:
    """The unit of the neighbouring segments."""
    at = track(view, units.name)
    return _spread(units, view, *view.around(f"{units.name}_code", at.segment, offsets, at.segment_bounds), start, pad)


def _spread(units: Units, view: View, codes: Any, outside: Any, start: int, pad: int) -> Any:
    """``start + place * width + code``; in places outside the column of the unit that stands there, or ``pad``."""
    places, width = codes.shape[1], len(units.names)
    base = view.constant(("base", start, places, width), lambda: np.arange(places, dtype=np.int32) * width + start)
    return view.put(codes + base, outside, pad if units.outside is None else base + units.outside)


def frames(unit: str, view: View, start: int, pad: int) -> Any:
    """The number of frames in the segment."""
    return track(view, unit).frames[:, None]


def span(unit: str, view: View, start: int, pad: int) -> Any:
    """The number of frames until the unit changes, this one included: 1 in the last frame."""
    at = track(view, unit)
    return (at.frames - at.elapsed)[:, None]


def fraction(unit: str, view: View, start: int, pad: int) -> Any:
    """Where in its segment the centre of this frame lies, between 0 and 1."""
    at = track(view, unit)
    return ((at.elapsed + 0.5) / at.frames)[:, None]


def of_segment(unit: str, name: str, view: View, start: int, pad: int) -> Any:
    """A count that belongs to the segment."""
    return track(view, unit).of_segment(name)[:, None]
