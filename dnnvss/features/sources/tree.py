"""Positions and counts of the linguistic tree, from the syllable to the utterance, for each phone."""

from functools import partial
from typing import Any

import numpy as np

from dnnvss.features.block import Block, binary, numeric, table_1
from dnnvss.features.fields import Field
from dnnvss.features.sources.segments import THIRDS, thirds, track
from dnnvss.features.view import View
from dnnvss.text.tree import LinguisticTree

POSITIONS = ("phone_in_syllable", "syllable_in_word", "syllable_in_phrase", "word_in_phrase", "syllable_in_utterance",
             "word_in_utterance", "phrase_in_utterance")
COUNTS = ("phones_in_syllable", "syllables_in_word", "syllables_in_phrase", "words_in_phrase")
NOWHERE = 3
"""The position code of a silence: neither start (0) nor middle (1) nor end (2)."""

TREE_FIELDS: dict[str, Field] = {
    "positions": Field("phone", np.uint8, POSITIONS),
    "counts": Field("phone", np.uint16, COUNTS),
}


def tree_arrays(tree: LinguisticTree) -> dict[str, Any]:
    """Position codes (S, 7) and counts (S, 4) of each segment of the tier ``phones``."""
    positions = []
    for name in POSITIONS:
        part, _, whole = name.partition("_in_")
        index = getattr(tree, part if whole == "utterance" else name)
        count = getattr(tree, f"{part}s") if whole == "utterance" else getattr(tree, f"{part}s_in_{whole}")
        positions.append(np.where(index < 0, NOWHERE, thirds(np.maximum(index, 0), np.maximum(count, 1))))
    return {"positions": np.stack(positions, 1), "counts": np.stack([getattr(tree, name) for name in COUNTS], 1)}


def tree_blocks() -> list[Block]:
    """A block for each position and each count."""
    blocks = []
    for name in POSITIONS:
        part, _, whole = name.partition("_in_")
        count = f"{part}s_in_{whole}"
        row = f"{part}s".replace("phones", "phonemes")
        paper = table_1(f"utterance: position of {part} in utterance" if whole == "utterance" else
                        f"{whole}: position and number of {row} in {whole}")
        blocks.append(binary(f"{whole}_{part}_position", whole, ("phones",), paper,
                             f"the third of the {whole} in which the {part} lies; none in silence", THIRDS, 1,
                             partial(tree_position, name)))
        if count in COUNTS:
            blocks.append(numeric(f"{whole}_{part}s", whole, ("phones",), f"{part}s", paper,
                                  f"{part}s in the {whole}; 0 in silence", (f"{part}s",), partial(tree_count, count)))
    return blocks


def tree_position(name: str, view: View, start: int, pad: int) -> Any:
    """The third of the larger unit in which the smaller one lies; none in silence."""
    third = track(view, "phone").of_segment("positions")[:, POSITIONS.index(name)][:, None]
    return view.xp.where(third == NOWHERE, pad, third + start)


def tree_count(name: str, view: View, start: int, pad: int) -> Any:
    """How many smaller units the larger one has; 0 in silence."""
    return track(view, "phone").of_segment("counts")[:, COUNTS.index(name)][:, None]
