"""What the fills read: a batch of frames and the label arrays, NumPy or torch, by indexing and arithmetic alone."""

import weakref
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import ModuleType
from typing import Any

import numpy as np


def library(array: Any) -> ModuleType:
    """Return ``numpy`` for an array and ``torch`` for a tensor."""
    if isinstance(array, np.ndarray):
        return np
    import torch  # only a tensor brings us here, so torch is loaded already

    return torch


@dataclass(frozen=True)
class Track:
    """One tier at a batch of frames; every array has the shape (B,) and is int64 unless it says otherwise.

    Args:
        view: the batch that it belongs to.
        name: ``phone`` or ``viseme``.
    """

    view: "View"
    name: str

    def of_segment(self, name: str) -> Any:
        """Return the rows of an array that belong to the segments, int64 (B, ...); gathered once a batch."""
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
        start = self.view.wide("utterance_start", self.utterance)
        return start, start + self.view.wide("utterance_frames", self.utterance)


@dataclass(frozen=True)
class View:
    """A batch of frames of the arrays declared in :mod:`dnnvss.features.fields`.

    Args:
        arrays: by name, NumPy arrays or tensors of one device.
        frames: (B,) int64 indices of frames.
        constants: a memory of small arrays that belong to the device, kept between batches.
        gathered: a memory of this batch.
    """

    arrays: Mapping[str, Any]
    frames: Any
    constants: dict[Any, Any] = field(default_factory=dict)
    gathered: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def xp(self) -> ModuleType:
        """The library that the arrays belong to."""
        return library(self.frames)

    @cached_property
    def phone(self) -> Track:
        """The tier of phones."""
        return self._tier("phone")

    @cached_property
    def viseme(self) -> Track:
        """The tier of dynamic visemes."""
        return self._tier("viseme")

    def _tier(self, name: str) -> Track:
        return Track(weakref.proxy(self), name)  # no circle: a batch's arrays are gone with its view

    def track(self, name: str) -> Track:
        """Return the tier ``phone`` or ``viseme``."""
        return self.phone if name == "phone" else self.viseme

    def wide(self, name: str, index: Any) -> Any:
        """Return rows of an array as int64, so that sums of small types do not wrap around."""
        return self.cast(self.arrays[name][index], "int64")

    def cast(self, array: Any, dtype: str) -> Any:
        """Return the array in another type."""
        if self.xp is np:
            return array.astype(dtype)
        return array.to(getattr(self.xp, dtype))

    def constant(self, key: Any, build: Callable[[], np.ndarray]) -> Any:
        """Return a small array on the device of the batch, built once."""
        if key not in self.constants:
            array = build()
            self.constants[key] = array if self.xp is np else self.xp.as_tensor(array, device=self.frames.device)
        return self.constants[key]

    def around(self, name: str, index: Any, offsets: tuple[int, ...], bounds: tuple[Any, Any]) -> tuple[Any, Any]:
        """Return ``name[index + offset]``, int32 (B, len(offsets)), and which places lie outside the bounds.

        The second is for :meth:`put` only: on NumPy it holds the few rows that reach over a border, which is four times
        faster than a mask of everything; on a device, where a number of rows that depends on values would wait for the
        host, it is a mask.
        """
        low, high = bounds
        shift = self.constant(("offsets", offsets), lambda: np.array(offsets, dtype=np.int64))
        places, source = index[:, None] + shift, self.arrays[name]
        if self.xp is not np:
            values = source[self.xp.clip(places, 0, len(source) - 1)]
            return self.cast(values, "int32"), (places < low[:, None]) | (places >= high[:, None])
        rows = np.flatnonzero((index + min(offsets) < low) | (index + max(offsets) >= high))
        mask = (places[rows] < low[rows, None]) | (places[rows] >= high[rows, None])
        return source.take(places, mode="clip").astype(np.int32), (rows, mask)

    def put(self, values: Any, outside: Any, replacement: Any) -> Any:
        """Return the values of :meth:`around`, ``replacement`` (a number or one a column) in the places outside."""
        if self.xp is not np:
            return self.xp.where(outside, replacement, values)
        rows, mask = outside
        values[rows] = np.where(mask, replacement, values[rows])
        return values
