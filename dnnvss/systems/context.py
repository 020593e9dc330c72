"""Frames around the current one beside it: what systems see that are given one row a frame."""

import numpy as np

from dnnvss.features import FrameCodes, expand
from dnnvss.timing import FrameClock


def offsets(frames: int, step: float, clock: FrameClock) -> tuple[int, ...]:
    """The places (2t + 1,) of ``frames`` (t) frames on each side, ``step`` seconds apart, in frames of a clock."""
    return tuple(round(k * step * float(clock.rate)) for k in range(-frames, frames + 1))


def with_context(rows: np.ndarray, places: tuple[int, ...]) -> np.ndarray:
    """Rows (T, C) with those at other places beside them, (T, places x C); the first and last row are held.

    **Source**: Theobald and Wilkinson 2007, section 4.3.1.
    """
    index = np.arange(len(rows))[:, None] + np.array(places)
    return rows[np.clip(index, 0, len(rows) - 1)].reshape(len(rows), -1)


def inputs(codes: FrameCodes, places: tuple[int, ...]) -> np.ndarray:
    """All columns of the labels, float32 (T, places x C): numbers as they are, binary columns as 0 and 1."""
    return with_context(expand(codes), places)
