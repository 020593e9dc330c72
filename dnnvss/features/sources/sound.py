"""The sound as dense columns, of the frame itself and of a few frames around: a source for each analysis."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from dnnvss.acoustics import Analysis, Moments, analyse, normalised, talker_moments
from dnnvss.errors import DnnvssError
from dnnvss.features.block import Block, Settings, at_offsets, numeric
from dnnvss.features.fields import Field
from dnnvss.features.recording import Recording
from dnnvss.features.sources.base import FeatureSource
from dnnvss.features.view import View
from dnnvss.media import Sound
from dnnvss.timing import FrameClock


def analysis_of(settings: Settings, name: str) -> Analysis:
    """The analysis of a source, as the settings have it."""
    return getattr(settings, name)


def offsets_of(settings: Settings, name: str) -> tuple[int, ...]:
    """The frames around the current one at which a source is seen."""
    return settings.logmel_offsets if name == "logmel" else settings.sound_offsets


def dense_blocks(name: str, settings: Settings) -> list[Block]:
    """The block of a source's columns at the frame, and the one of its columns at frames around."""
    made, offsets = analysis_of(settings, name), offsets_of(settings, name)
    (what, how), names = made.meaning, made.columns
    how += told_norm(settings)
    return [
        numeric(name, "frame", (name,), made.unit, made.paper, f"{what} of this frame {how}", names,
                partial(at_frame, name)),
        numeric(f"{name}_window", "frame", (name,), made.unit, made.paper,
                f"{what} of a few frames around {how}; the ends of the utterance are held",
                at_offsets(offsets, names), partial(around, name, offsets)),
    ]


def told_norm(settings: Settings) -> str:
    """How columns of a sound are normalised, in words; nothing where they are not."""
    what = {"none": "", "talker": "recordings of the talker", "recording": "recording", "running": "recording so far"}
    return (told := what[settings.sound_norm]) and f", normalised by the {told}"


def at_frame(name: str, view: View, start: int, pad: int) -> Any:
    """The columns (B, C) of this frame."""
    return view.rows(name, view.frames)


def around(name: str, offsets: tuple[int, ...], view: View, start: int, pad: int) -> Any:
    """The columns at frames around, (B, offsets x C); beyond the utterance those of its first or last frame."""
    shift = view.constant(("offsets", offsets), lambda: np.array(offsets, dtype=np.int64))
    low, high = view.frame_bounds(view.utterance)
    places = view.xp.clip(view.frames[:, None] + shift, low[:, None], high[:, None] - 1)
    return view.rows(name, places).reshape(len(places), -1)


def heard(recording: Recording, clock: FrameClock) -> tuple[Sound, int]:
    """The sound of a recording, and the first frame of its times.

    Raises:
        DnnvssError: the sound is much shorter.
    """
    sound, (first, last) = recording.sound, recording.span(clock)
    assert sound is not None
    if sound.seconds < clock.seconds((first + last) // 2):
        raise DnnvssError(f"the sound lasts {sound.seconds:.2f} s and the alignment {clock.seconds(last):.2f} s",
                          remedy="Give the recording that the times belong to")
    return sound, first


def _source(name: str) -> FeatureSource:
    """The source of an analysis whose settings are those of its name."""

    def fields(settings: Settings) -> Mapping[str, Field]:
        return {name: Field("frame", np.float32, analysis_of(settings, name).columns)}

    def blocks(settings: Settings) -> list[Block]:
        return dense_blocks(name, settings)

    def encode(recording: Recording, settings: Settings, clock: FrameClock, frames: int) -> dict[str, Any]:
        (sound, first), made = heard(recording, clock), analysis_of(settings, name)

        def whole(other: Sound) -> np.ndarray:
            return analyse(other, made, clock, 0, clock.edge(other.seconds))

        def talker() -> Moments:
            return talker_moments(sound, whole, (made, clock), made.spread)

        rows = analyse(sound, made, clock, first, frames)
        return {name: normalised(rows, settings.sound_norm, made.spread, float(clock.rate), talker)}

    def facts(settings: Settings, clock: FrameClock) -> str:
        at = ", ".join(f"{1000 * clock.seconds(offset):+g}" for offset in offsets_of(settings, name))
        made = analysis_of(settings, name)
        return f"Sound ({name}): {len(made.columns)} columns, {made.where}, and those at {at or 'no other'} ms."

    return FeatureSource(name, frozenset({"sound"}), fields, blocks, encode,
                         ("needs the sound, and there is none", "Encode recordings with their sound"), facts,
                         key=lambda settings: analysis_of(settings, name).key + settings.norm)


SOUND_SOURCES = tuple(map(_source, ("logmel", "mfcc", "lpc", "lsf", "formants", "energy", "voicing")))
"""A source for each analysis of the sound."""
