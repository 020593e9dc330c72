"""A corpus of any size that needs no recordings: random phones, visemes and linguistic context as frame codes."""

from pathlib import Path

import numpy as np
import yaml

from dnnvss.features import CodeStore, FeatureTable
from dnnvss.features.sources import array_fields
from dnnvss.features.sources.tree import COUNTS, NOWHERE, POSITIONS
from dnnvss.phones import SILENCE, SPOKEN, phone_id

UTTERANCE = 2000
"""Frames an utterance; the paper's 2,543 sentences of 14 hours have about as many."""
PHONE_FRAMES, VISEME_FRAMES = (4, 14), (5, 16)


def synthetic_store(table: FeatureTable, frames: int, seed: int = 0) -> CodeStore:
    """Return the store of ``frames`` frames (rounded up to whole utterances), made without a loop over frames.

    Phones are drawn as often as a phone of rank r in English is met, 1 / (r + 2); so are dynamic visemes.
    """
    rng, count = np.random.default_rng(seed), -(-frames // UTTERANCE)
    arrays = {"utterance_start": np.arange(count) * UTTERANCE, "utterance_frames": np.full(count, UTTERANCE)}
    for name, lengths in (("phone", PHONE_FRAMES), ("viseme", VISEME_FRAMES)):
        arrays |= _track(name, count, lengths, rng)
    phones = [phone_id(p) for p in SPOKEN]
    silent = arrays["phone_code"] = rng.permutation(phones)[_zipf(len(arrays["phone_start"]), len(phones), rng)]
    ends = np.r_[arrays["utterance_phone_start"], arrays["utterance_phone_start"] + arrays["utterance_phones"] - 1]
    silent[ends] = phone_id(SILENCE)
    arrays["viseme_code"] = _zipf(len(arrays["viseme_start"]), table.settings.units, rng)
    for name in ("phone", "viseme"):
        arrays[name] = arrays[f"{name}_code"][arrays[f"{name}_segment"]]
    arrays |= _context(arrays, rng)
    typed: dict[str, np.ndarray] = {name: np.ascontiguousarray(arrays[name], dtype=field.dtype)
             for name, field in array_fields(("phones", "visemes"), table.settings).items()}
    return CodeStore(table, typed, "100", ids=tuple(f"u{i}" for i in range(count)))


def _zipf(size: int, kinds: int, rng: np.random.Generator) -> np.ndarray:
    weight = 1 / (np.arange(kinds) + 2)
    return np.minimum(np.searchsorted(np.cumsum(weight / weight.sum()), rng.random(size)), kinds - 1)


def _track(name: str, utterances: int, lengths: tuple[int, int], rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Return the arrays of a tier: every utterance is cut into segments of random lengths."""
    total = utterances * UTTERANCE
    cuts = np.cumsum(rng.integers(*lengths, endpoint=True, size=total // lengths[0]))
    starts = np.union1d(cuts[cuts < total], np.arange(utterances) * UTTERANCE)
    length, owner = np.diff(np.r_[starts, total]), starts // UTTERANCE
    first = np.searchsorted(owner, np.arange(utterances))
    return {f"{name}_start": starts, f"{name}_frames": length, f"{name}_utterance": owner,
            f"{name}_segment": np.repeat(np.arange(len(starts)), length), f"utterance_{name}_start": first,
            f"utterance_{name}s": np.diff(np.r_[first, len(starts)])}


def _context(arrays: dict[str, np.ndarray], rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Return linguistic positions and counts, and what visemes share with phones and syllables."""
    segments, spoken = len(arrays["phone_start"]), arrays["phone_code"] != phone_id(SILENCE)
    first = arrays["viseme_segment"][arrays["phone_start"]]
    last = arrays["viseme_segment"][arrays["phone_start"] + arrays["phone_frames"] - 1]
    positions = rng.integers(0, 3, (segments, len(POSITIONS)))
    return {"positions": np.where(spoken[:, None], positions, NOWHERE),
            "counts": np.where(spoken[:, None], rng.integers(1, 8, (segments, len(COUNTS))), 0),
            "syllable_viseme_start": first, "syllable_visemes": np.where(spoken, last - first + 1, 0),
            "viseme_phones": rng.integers(1, 4, len(arrays["viseme_start"]))}


def all_features() -> FeatureTable:
    """Return the table of ``conf/labels/ph_dv.yaml``: phones and 160 dynamic visemes, 7,735 columns."""
    config = yaml.safe_load((Path(__file__).parents[1] / "conf/labels/ph_dv.yaml").read_text(encoding="utf-8"))
    return FeatureTable.from_config({key: config[key] for key in ("name", "blocks")})
