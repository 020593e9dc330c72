"""From an alignment and its text to frame codes."""

from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.features.codes import FrameCodes, check_units
from dnnvss.features.fields import COUNTS, NOWHERE, POSITIONS, fields, thirds
from dnnvss.features.table import FeatureTable
from dnnvss.phones import SILENCES, phone_id
from dnnvss.text.tree import LinguisticTree, linguistic_tree
from dnnvss.timing import Alignment, FrameClock, Tier


def encode(alignment: Alignment, text: str, table: FeatureTable, clock: FrameClock) -> FrameCodes:
    """Return the frame codes of an utterance; frame 0 begins where the alignment begins.

    Args:
        alignment: tiers ``phones`` and ``words``; ``visemes`` too if the table asks for them, its labels unit numbers.
        text: the words as written.
        table: the columns to serve.
        clock: frame rate.

    Raises:
        DnnvssError: a tier is missing, a phone or unit is unknown, the alignment is shorter than a frame, or a segment
            is longer than 65,535 frames.
    """
    phones = alignment["phones"]
    edges = _edges(phones, clock, None)
    if edges[-1] == 0:
        length = f"{phones.end - phones.start:.4f} s"
        raise DnnvssError(f"the alignment ({length}) is shorter than half a frame at {clock} frames a second",
                          remedy="Leave the utterance out, or choose a higher frame rate")
    codes = np.array([phone_id(label) for label in phones.labels])
    tree = linguistic_tree(alignment, text)
    arrays = {**_segments("phone", codes, edges), **_whole(edges), **_linguistic(tree)}
    if table.uses_visemes:
        tier = alignment["visemes"]
        units = np.array([_unit(label, table.settings.units) for label in tier.labels])
        viseme_edges = _edges(tier, clock, int(edges[-1]))
        arrays |= _segments("viseme", units, viseme_edges)
        arrays |= _shared(phones, tree.syllable, edges, viseme_edges)
    check_units(table, arrays)
    return FrameCodes(table, _typed(arrays, table.uses_visemes), str(clock))


def _edges(tier: Tier, clock: FrameClock, frames: int | None) -> np.ndarray:
    """Return a tier's frame edges from 0; with ``frames`` it ends there, wherever its own last edge rounds to."""
    edges = tier.frame_edges(clock)
    edges = edges - edges[0]
    if frames is not None:
        edges = np.minimum(edges, frames)
        edges[-1] = frames
    longest = int(np.diff(edges).max())
    if longest > np.iinfo(np.uint16).max:
        raise DnnvssError(f"tier {tier.name!r} has a segment of {longest} frames",
                          remedy="Cut the recording into sentences")
    return edges


def _unit(label: str, units: int) -> int:
    number = int(label) if label.isascii() and label.isdigit() else -1
    if not 0 <= number < units:
        raise DnnvssError(f"tier 'visemes': {label!r} is no unit from 0 to {units - 1}",
                          remedy="Write dynamic visemes as numbers, or set labels.units to how many there are")
    return number


def _segments(name: str, codes: np.ndarray, edges: np.ndarray) -> dict[str, Any]:
    """Return the arrays of a tier: per segment, per frame and for the utterance."""
    owner = np.repeat(np.arange(len(codes)), np.diff(edges))
    return {
        name: codes[owner], f"{name}_segment": owner, f"{name}_code": codes, f"{name}_start": edges[:-1],
        f"{name}_frames": np.diff(edges), f"{name}_utterance": np.zeros(len(codes)),
        f"utterance_{name}_start": [0], f"utterance_{name}s": [len(codes)],
    }  # fmt: skip


def _whole(edges: np.ndarray) -> dict[str, Any]:
    return {"utterance_start": [0], "utterance_frames": [edges[-1]]}


def _linguistic(tree: LinguisticTree) -> dict[str, Any]:
    """Return position codes (S, 7) and counts (S, 4) of each segment of the phones tier."""
    positions = []
    for name in POSITIONS:
        part, _, whole = name.partition("_in_")
        index = getattr(tree, part if whole == "utterance" else name)
        count = getattr(tree, f"{part}s") if whole == "utterance" else getattr(tree, f"{part}s_in_{whole}")
        positions.append(np.where(index < 0, NOWHERE, thirds(np.maximum(index, 0), np.maximum(count, 1))))
    return {"positions": np.stack(positions, 1), "counts": np.stack([getattr(tree, name) for name in COUNTS], 1)}


def _shared(phones: Tier, syllable: np.ndarray, edges: np.ndarray, viseme_edges: np.ndarray) -> dict[str, Any]:
    """Return what visemes share with phones and syllables.

    A viseme holds the phones from the one at its first frame to the one at its last, a syllable the visemes likewise;
    those between that are too short to own a frame are counted.
    """
    phone_at, viseme_at = (np.repeat(np.arange(len(e) - 1), np.diff(e)) for e in (edges, viseme_edges))
    spoken = np.cumsum([0, *(label not in SILENCES for label in phones.labels)])
    seen = np.diff(viseme_edges) > 0
    viseme_phones = np.zeros(len(seen), int)
    viseme_phones[seen] = spoken[phone_at[viseme_edges[1:][seen] - 1] + 1] - spoken[phone_at[viseme_edges[:-1][seen]]]
    first, count = np.zeros(len(syllable), int), np.zeros(len(syllable), int)
    inside = np.flatnonzero(syllable >= 0)
    low = edges[:-1][inside[np.searchsorted(syllable[inside], syllable[inside], side="left")]]
    high = edges[1:][inside[np.searchsorted(syllable[inside], syllable[inside], side="right") - 1]]
    framed = high > low
    opening, closing = viseme_at[low[framed]], viseme_at[high[framed] - 1]
    first[inside[framed]], count[inside[framed]] = opening, closing - opening + 1
    return {"viseme_phones": viseme_phones, "syllable_viseme_start": first, "syllable_visemes": count}


def _typed(arrays: dict[str, Any], visemes: bool) -> dict[str, np.ndarray]:
    return {name: np.asarray(arrays[name]).astype(field.dtype) for name, field in fields(visemes).items()}
