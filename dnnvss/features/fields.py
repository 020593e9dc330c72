"""The arrays that hold a corpus's labels compactly, declared once.

Per frame there is a unit code and the index of the segment that owns it, for phones and for dynamic visemes (8 bytes);
everything else is kept once a segment or once an utterance. No array depends on the choice of blocks.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

AXES = ("frame", "phone", "viseme", "utterance")
"""What the rows of an array can stand for: frames, segments of either tier, utterances."""


@dataclass(frozen=True)
class Field:
    """One array: what its rows stand for, its type, its columns, and what it points into.

    Args:
        axis: one of :data:`AXES`.
        dtype: NumPy type on disk and in memory.
        columns: names of the columns; empty for a vector.
        points_to: the axis whose rows its values count; such values are shifted when utterances are joined.
        visemes: whether it exists only where there are dynamic visemes.
    """

    axis: str
    dtype: type
    columns: tuple[str, ...] = ()
    points_to: str = ""
    visemes: bool = False


POSITIONS = ("phone_in_syllable", "syllable_in_word", "syllable_in_phrase", "word_in_phrase", "syllable_in_utterance",
             "word_in_utterance", "phrase_in_utterance")
COUNTS = ("phones_in_syllable", "syllables_in_word", "syllables_in_phrase", "words_in_phrase")
NOWHERE = 3
"""The position code of a silence: neither start (0) nor middle (1) nor end (2)."""

FIELDS: dict[str, Field] = {
    "phone": Field("frame", np.uint8),
    "phone_segment": Field("frame", np.int32, points_to="phone"),
    "phone_code": Field("phone", np.uint8),
    "phone_start": Field("phone", np.int32, points_to="frame"),
    "phone_frames": Field("phone", np.uint16),
    "phone_utterance": Field("phone", np.int32, points_to="utterance"),
    "positions": Field("phone", np.uint8, POSITIONS),
    "counts": Field("phone", np.uint16, COUNTS),
    "utterance_start": Field("utterance", np.int32, points_to="frame"),
    "utterance_frames": Field("utterance", np.int32),
    "utterance_phone_start": Field("utterance", np.int32, points_to="phone"),
    "utterance_phones": Field("utterance", np.int32),
    "viseme": Field("frame", np.uint16, visemes=True),
    "viseme_segment": Field("frame", np.int32, points_to="viseme", visemes=True),
    "viseme_code": Field("viseme", np.uint16, visemes=True),
    "viseme_start": Field("viseme", np.int32, points_to="frame", visemes=True),
    "viseme_frames": Field("viseme", np.uint16, visemes=True),
    "viseme_utterance": Field("viseme", np.int32, points_to="utterance", visemes=True),
    "viseme_phones": Field("viseme", np.uint16, visemes=True),
    "syllable_viseme_start": Field("phone", np.int32, points_to="viseme", visemes=True),
    "syllable_visemes": Field("phone", np.uint16, visemes=True),
    "utterance_viseme_start": Field("utterance", np.int32, points_to="viseme", visemes=True),
    "utterance_visemes": Field("utterance", np.int32, visemes=True),
}
"""Every array by name. ``*_start`` is the first row on the axis it points to; ``*_frames``, ``*_phones`` count rows."""


def fields(visemes: bool) -> dict[str, Field]:
    """Return the declared fields, with or without those of dynamic visemes."""
    return {name: field for name, field in FIELDS.items() if visemes or not field.visemes}


def thirds(index: Any, count: Any) -> Any:
    """Return 0, 1 or 2 for the start, middle or end third in which place ``index`` of ``count`` has its centre.

    ``floor(3 (index + 1/2) / count)``, exact in integers: one place is the middle, two are start and end, three are
    start, middle and end.
    """
    return 3 * (2 * index + 1) // (2 * count)
