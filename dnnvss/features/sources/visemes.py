"""Dynamic visemes: which, where in them, and what they share with phones and syllables."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.features.block import Block, Settings, binary, numeric, table_1
from dnnvss.features.fields import Field
from dnnvss.features.recording import Recording
from dnnvss.features.sources.base import Codes, FeatureSource
from dnnvss.features.sources.segments import (
    THIRDS,
    Units,
    fraction_block,
    of_segment,
    segment_arrays,
    segment_fields,
    thirds,
    track,
    unit_blocks,
)
from dnnvss.features.view import View
from dnnvss.phones import SILENCES
from dnnvss.timing import FrameClock, Tier

_BOTH = ("visemes", "phones")
_FIELDS = {
    **segment_fields("viseme", np.uint16),
    "viseme_phones": Field("viseme", np.uint16),
    "syllable_viseme_start": Field("phone", np.int32, points_to="viseme"),
    "syllable_visemes": Field("phone", np.uint16),
}


@dataclass(frozen=True)
class VisemeSegments:
    """The dynamic visemes of frame codes, NumPy, a row for each of S segments.

    Args:
        code: number of the unit (S,) int64.
        frames: how many it has (S,) int64; 0 where it is too short to own one.
        phones: spoken phones from its first frame to its last (S,) int64.
    """

    code: np.ndarray
    frames: np.ndarray
    phones: np.ndarray


def visemes_of(codes: Codes) -> VisemeSegments:
    """The dynamic visemes of frame codes that hold NumPy arrays of them."""
    names = ("viseme_code", "viseme_frames", "viseme_phones")
    return VisemeSegments(*(np.asarray(codes.arrays[name], np.int64) for name in names))


def _fields(settings: Settings) -> Mapping[str, Field]:
    del settings
    return _FIELDS


def _blocks(settings: Settings) -> list[Block]:
    units = Units("viseme", "visemes", "dynamic viseme", tuple(str(u) for u in range(settings.units)), np.uint16)
    number = table_1("syllable: position and number of dynamic visemes in syllable")
    return [
        *unit_blocks(units, settings.offsets, settings.neighbours),
        numeric("viseme_phones", "segment", ("visemes",), "phones",
                table_1("segment: number of phonemes in dynamic viseme"),
                "spoken phones from the viseme's first frame to its last", ("phones",),
                partial(of_segment, "viseme", "viseme_phones")),
        binary("syllable_viseme_position", "syllable", _BOTH, number,
               "the third of the syllable's visemes, from its first frame to its last; none in silence", THIRDS, 1,
               syllable_viseme_position),
        numeric("syllable_visemes", "syllable", _BOTH, "visemes", number,
                "visemes from the syllable's first frame to its last; 0 in silence", ("visemes",),
                partial(of_segment, "phone", "syllable_visemes")),
        fraction_block(units),
    ]


def syllable_viseme_position(view: View, start: int, pad: int) -> Any:
    """The third of the syllable's dynamic visemes in which this one lies; none in silence."""
    phone, viseme = track(view, "phone"), track(view, "viseme")
    count = phone.of_segment("syllable_visemes")
    index = viseme.segment - phone.of_segment("syllable_viseme_start")
    return view.xp.where(count == 0, pad, thirds(index, count + (count == 0)) + start)[:, None]


def _encode(recording: Recording, settings: Settings, clock: FrameClock, frames: int) -> dict[str, Any]:
    tier, phones = recording.tier("visemes"), recording.tier("phones")
    units = np.array([_unit(label, settings.units) for label in tier.labels])
    edges = recording.edges("visemes", clock, frames)
    shared = _shared(phones, recording.tree.syllable, recording.edges("phones", clock, frames), edges)
    return {**segment_arrays("viseme", units, edges), **shared}


def _unit(label: str, units: int) -> int:
    number = int(label) if label.isascii() and label.isdigit() else -1
    if not 0 <= number < units:
        raise DnnvssError(f"tier 'visemes': {label!r} is no unit from 0 to {units - 1}",
                          remedy="Write dynamic visemes as numbers, or set labels.units to how many there are")
    return number


def _shared(phones: Tier, syllable: np.ndarray, edges: np.ndarray, viseme_edges: np.ndarray) -> dict[str, Any]:
    """What visemes share with phones and syllables.

    A viseme holds the phones from the one at its first frame to the one at its last, a syllable the visemes likewise;
    those between that are too short to own a frame are counted.
    """
    phone_at, viseme_at = (np.repeat(np.arange(len(e) - 1), np.diff(e)) for e in (edges, viseme_edges))
    spoken = np.cumsum([0, *(label not in SILENCES for label in phones.labels)])
    seen = np.diff(viseme_edges) > 0
    viseme_phones = np.zeros(len(seen), int)
    begins, ends = viseme_edges[:-1][seen], viseme_edges[1:][seen]
    first_phone, last_phone = phone_at[begins], phone_at[ends - 1]
    viseme_phones[seen] = spoken[last_phone + 1] - spoken[first_phone]
    first, count = np.zeros(len(syllable), int), np.zeros(len(syllable), int)
    inside = np.flatnonzero(syllable >= 0)
    low = edges[:-1][inside[np.searchsorted(syllable[inside], syllable[inside], side="left")]]
    high = edges[1:][inside[np.searchsorted(syllable[inside], syllable[inside], side="right") - 1]]
    framed = high > low
    opening, closing = viseme_at[low[framed]], viseme_at[high[framed] - 1]
    first[inside[framed]], count[inside[framed]] = opening, closing - opening + 1
    return {"viseme_phones": viseme_phones, "syllable_viseme_start": first, "syllable_visemes": count}


def _check(settings: Settings, arrays: Mapping[str, Any]) -> None:
    highest = int(arrays["viseme_code"].max())
    if highest >= settings.units:
        raise DnnvssError(f"dynamic viseme {highest} is outside the table's {settings.units} units",
                          remedy=f"Set labels.units to at least {highest + 1}")


VISEME_SOURCE = FeatureSource(
    name="visemes",
    needs=frozenset({"visemes", "phones", "words"}),
    fields=_fields,
    blocks=_blocks,
    encode=_encode,
    absent=("needs dynamic visemes, and there are none",
            "Encode alignments with a tier 'visemes', or choose labels without dynamic visemes"),
    facts=lambda settings, clock: f"Dynamic visemes: {settings.units}.",
    check=_check,
)
