"""What blocks read: a batch of frames and the arrays of sources, NumPy or torch, by indexing and arithmetic alone."""

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
class View:
    """A batch of frames of the arrays that feature sources declare.

    Args:
        arrays: by name, NumPy arrays or tensors of one device.
        frames: (B,) int64 indices of frames.
        constants: a memory of small arrays that belong to the device, kept between batches.
        gathered: a memory of this batch: rows of arrays by name.
        tracks: a memory of this batch: what sources derive from it, by name.
    """

    arrays: Mapping[str, Any]
    frames: Any
    constants: dict[Any, Any] = field(default_factory=dict)
    gathered: dict[str, Any] = field(default_factory=dict)
    tracks: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def xp(self) -> ModuleType:
        """The library that the arrays belong to."""
        return library(self.frames)

    @cached_property
    def utterance(self) -> Any:
        """Index (B,) of the utterance that each frame belongs to."""
        starts = self.arrays["utterance_start"]
        if self.xp is np:
            return np.searchsorted(starts, self.frames, side="right") - 1
        return self.xp.searchsorted(starts, self.frames.to(starts.dtype), right=True) - 1

    def frame_bounds(self, utterance: Any) -> tuple[Any, Any]:
        """First frame (B,) of each utterance, and the one after its last."""
        start = self.wide("utterance_start", utterance)
        return start, start + self.wide("utterance_frames", utterance)

    def wide(self, name: str, index: Any) -> Any:
        """Return rows of an array as int64, so that sums of small types do not wrap around."""
        return self.cast(self.arrays[name][index], "int64")

    def rows(self, name: str, index: Any) -> Any:
        """Rows of an array as they are, (*index.shape, ...); NumPy's ``take`` is four times as fast as its index."""
        source = self.arrays[name]
        return source.take(index, axis=0) if self.xp is np else source[index]

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
