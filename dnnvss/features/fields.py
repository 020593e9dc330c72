"""How an array of frame codes is declared: what its rows stand for, its type, and what it points into."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Field:
    """One array.

    Args:
        axis: what a row stands for: ``frame``, ``utterance``, or an axis of the source's own, such as ``phone``.
        dtype: NumPy type on disk and in memory.
        columns: names of the columns; empty for a vector.
        points_to: the axis whose rows its values count; such values are shifted when utterances are joined.
    """

    axis: str
    dtype: type
    columns: tuple[str, ...] = ()
    points_to: str = ""


WHOLE: dict[str, Field] = {
    "utterance_start": Field("utterance", np.int32, points_to="frame"),
    "utterance_frames": Field("utterance", np.int32),
}
"""The arrays that belong to no source: the first frame of each utterance, and how many it has."""
