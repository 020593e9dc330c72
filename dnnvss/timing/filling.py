"""Frames without a measurement, filled from those around them."""

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
