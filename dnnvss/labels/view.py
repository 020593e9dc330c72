"""What the fills read: a batch of frames and the label arrays, NumPy or torch, by indexing and arithmetic alone."""

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

    def _of_segment(self, what: str) -> Any:
        return self.view.wide(f"{self.name}_{what}", self.segment)

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
        return self.view.frames - self._of_segment("start")

    @cached_property
    def frames(self) -> Any:
        """Frames of the segment."""
        return self._of_segment("frames")

    @cached_property
    def utterance(self) -> Any:
        """Index of the utterance."""
        return self._of_segment("utterance")

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
    """A batch of frames of the arrays declared in :mod:`dnnvss.labels.fields`.

    Args:
        arrays: by name, NumPy arrays or tensors of one device.
        frames: (B,) int64 indices of frames.
        constants: a memory of small arrays that belong to the device, kept between batches.
    """

    arrays: Mapping[str, Any]
    frames: Any
    constants: dict[Any, Any] = field(default_factory=dict)

    @cached_property
    def xp(self) -> ModuleType:
        """The library that the arrays belong to."""
        return library(self.frames)

    @cached_property
    def phone(self) -> Track:
        """The tier of phones."""
        return Track(self, "phone")

    @cached_property
    def viseme(self) -> Track:
        """The tier of dynamic visemes."""
        return Track(self, "viseme")

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
        """Return ``name[index + offset]`` (B, len(offsets)) and whether each place lies inside the bounds."""
        low, high = bounds
        shift = self.constant(("offsets", offsets), lambda: np.array(offsets, dtype=np.int64))
        places = index[:, None] + shift[None]
        inside = (places >= low[:, None]) & (places < high[:, None])
        values = self.arrays[name][self.xp.clip(places, 0, len(self.arrays[name]) - 1)]
        return values, inside
