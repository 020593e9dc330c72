"""Frames without a measurement, filled from those around them."""

from itertools import pairwise

import numpy as np


def fill_invalid(values: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """Values with the frames that are not valid on straight lines between their neighbours, held at the ends.

    Args:
        values: (F, ...) floats, which may be NaN where they are not valid; their type is kept.
        valid: (F,) bool. Where no frame is valid, the values stay as they are.
    """
    known = np.flatnonzero(valid)
    if len(known) in (0, len(valid)):
        return values.copy()
    frames, flat = np.arange(len(values)), values.reshape(len(values), -1)
    columns = [np.interp(frames, known, column[known]) for column in flat.T]
    return np.stack(columns, axis=1).astype(values.dtype, copy=False).reshape(values.shape)


BRIDGE = 0.1
"""Seconds of a gap that a straight line may bridge: about a short phone's length."""


def bridged(measured: np.ndarray, rate: float, longest: float = BRIDGE) -> np.ndarray:
    """The frames (F,) bool in short gaps between two measured ones, which a straight line may stand in for.

    Args:
        measured: (F,) bool.
        rate: frames a second.
        longest: seconds of the longest gap; what is longer, or has nothing measured on one side, is in no bridge.
    """
    known = np.flatnonzero(measured)
    frames = np.zeros(len(measured), dtype=bool)
    for before, after in pairwise(known.tolist()):
        if 1 < after - before <= longest * rate + 1 + 1e-9:
            frames[before + 1 : after] = True
    return frames
