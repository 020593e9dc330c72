"""Phones: which, where in them, what they answer to the questions, and their place in the linguistic tree."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dnnvss.features.block import Block, Settings
from dnnvss.features.fields import Field
from dnnvss.features.recording import Recording
from dnnvss.features.sources.base import Codes, FeatureSource
from dnnvss.features.sources.phone_classes import class_blocks, class_context_blocks
from dnnvss.features.sources.segments import (
    Units,
    fraction_block,
    segment_arrays,
    segment_fields,
    unit_blocks,
)
from dnnvss.features.sources.tree import TREE_FIELDS, tree_arrays, tree_blocks
from dnnvss.phones import PHONES, SILENCE, phone_id
from dnnvss.timing import FrameClock

_FIELDS = {**segment_fields("phone", np.uint8), **TREE_FIELDS}
_UNITS = Units("phone", "phones", "phoneme", PHONES, np.uint8, phone_id(SILENCE), "silence")


@dataclass(frozen=True)
class PhoneSegments:
    """The phones of frame codes, NumPy, a row for each of S segments.

    Args:
        code: of the phone (S,) int64.
        start: its first frame (S,) int64.
        frames: how many it has (S,) int64; 0 where it is too short to own one.
        positions: (S, 7) thirds of the larger unit in which it lies, columns
            :data:`~dnnvss.features.sources.tree.POSITIONS`.
        counts: (S, 4) how many smaller units the larger ones have, columns
            :data:`~dnnvss.features.sources.tree.COUNTS`.
    """

    code: np.ndarray
    start: np.ndarray
    frames: np.ndarray
    positions: np.ndarray
    counts: np.ndarray


def phones_of(codes: Codes) -> PhoneSegments:
    """The phones of frame codes that hold NumPy arrays."""
    arrays = codes.arrays
    code, start, frames = (np.asarray(arrays[name], np.int64) for name in ("phone_code", "phone_start", "phone_frames"))
    return PhoneSegments(code, start, frames, np.asarray(arrays["positions"]), np.asarray(arrays["counts"]))


def _fields(settings: Settings) -> Mapping[str, Field]:
    del settings
    return _FIELDS


def _blocks(settings: Settings) -> list[Block]:
    return [*unit_blocks(_UNITS, settings.offsets, settings.neighbours), *class_blocks(), *tree_blocks(),
            fraction_block(_UNITS), *class_context_blocks(_UNITS)]


def _encode(recording: Recording, settings: Settings, clock: FrameClock, frames: int) -> dict[str, Any]:
    tier = recording.tier("phones")
    codes = np.array([phone_id(label) for label in tier.labels])
    return {**segment_arrays("phone", codes, recording.edges("phones", clock, frames)), **tree_arrays(recording.tree)}


def _facts(settings: Settings, clock: FrameClock) -> str:
    before, after = (f"{n} frames ({1000 * clock.seconds(n):g} ms)"
                     for n in (settings.window_before, settings.window_after))
    return f"Window: {before} before and {after} after, at {clock} frames a second."


PHONE_SOURCE = FeatureSource(
    name="phones",
    needs=frozenset({"phones", "words"}),
    fields=_fields,
    blocks=_blocks,
    encode=_encode,
    absent=("needs phones, and there are none", "Encode an alignment with the tiers 'phones' and 'words'"),
    facts=_facts,
    always=True,
)
