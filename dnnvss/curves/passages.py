"""Long trajectories a passage at a time: what a frame does to another dies out, so that the far ones need no memory."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

LONG = 30_000
"""Frames up to which an utterance is worked on as a whole: five minutes at a hundred a second."""
_PASSAGE, _MARGIN = 12_000, 1_000
"""Frames of a passage, and of what is looked at on either side of it."""


def at_once(frames: int) -> bool:
    """Whether so many frames are worked on as a whole."""
    return frames <= LONG


def in_passages(frames: int, work: Callable[[slice], np.ndarray]) -> np.ndarray:
    """The rows (T, ...) that ``work`` gives, in passages where there are more than :data:`LONG`.

    Memory beside the result is that of a passage. The influence of frames on each other in the equations of parameter
    generation falls below rounding long before the margin ends, so that the result is that of the whole to rounding.

    Args:
        frames: T.
        work: gives the rows of a slice of the frames, a passage with its margins.
    """
    if at_once(frames):
        return work(slice(0, frames))
    out: np.ndarray | None = None
    for first, last, around in spans(frames):
        rows = work(around)[first - around.start : last - around.start]
        if out is None:
            out = np.empty((frames, *rows.shape[1:]), rows.dtype)
        out[first:last] = rows
    assert out is not None
    return out


def rewritten(rows: np.ndarray, work: Callable[[slice, np.ndarray], np.ndarray]) -> np.ndarray:
    """What ``work`` makes of rows (T, ...), in passages and in place where there are more than :data:`LONG`.

    Args:
        rows: an array of the caller's own; not to be used afterwards.
        work: gives the new rows of a slice of the frames, a passage with its margins, from the rows as they were.
    """
    frames = len(rows)
    if at_once(frames):
        return work(slice(0, frames), rows)
    before = rows[:0]  # what has been written over, and is the margin of the next passage
    for first, last, around in spans(frames):
        given = np.concatenate([before, rows[first : around.stop]])
        before = given[max(last - _MARGIN, 0) - around.start : last - around.start]
        rows[first:last] = work(around, given)[first - around.start : last - around.start]
    return rows


def spans(frames: int) -> Iterator[tuple[int, int, slice]]:
    """Yield the first frame of each passage, the one after its last, and the slice with its margins."""
    step = frames if at_once(frames) else _PASSAGE
    for first in range(0, frames, step):
        last = min(first + step, frames)
        yield first, last, slice(max(first - _MARGIN, 0), min(last + _MARGIN, frames))


def cut(variance: Any, frames: int, around: slice) -> Any:
    """The part of variances that broadcast to (T, W, D), itself where all frames share them."""
    return variance[around] if np.ndim(variance) == 3 and len(variance) == frames else variance
