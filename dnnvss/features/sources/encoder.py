"""The sound as a pretrained encoder hears it: 50 outputs a second, kept as they are, told between them on the clock."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from dnnvss.acoustics import RATE, encoder_outputs, normalised, places_of, talker_moments
from dnnvss.acoustics.encoder import SPREAD, STEP
from dnnvss.features.block import Block, Settings, at_offsets, numeric
from dnnvss.features.fields import Field
from dnnvss.features.recording import Recording
from dnnvss.features.sources.base import FeatureSource
from dnnvss.features.sources.sound import heard, told_norm
from dnnvss.features.view import View
from dnnvss.timing import FrameClock

_UNIT = "activation"
_PAPER = "Radford 2022, Whisper tiny.en"


def _fields(settings: Settings) -> Mapping[str, Field]:
    return {"encoder": Field("encoder", np.float16, settings.encoder.columns),
            "encoder_before": Field("frame", np.int32, points_to="encoder"),
            "encoder_share": Field("frame", np.float32)}


def _blocks(settings: Settings) -> list[Block]:
    made, names, offsets = settings.encoder, settings.encoder.columns, settings.encoder_offsets
    what = f"the outputs of a pretrained encoder of speech (encoder {made.key})" + told_norm(settings)
    return [
        numeric("encoder", "frame", ("encoder",), _UNIT, _PAPER, f"{what} at this frame", names, _at_frame),
        numeric("encoder_window", "frame", ("encoder",), _UNIT, _PAPER,
                f"{what} at a few frames around; the ends of the utterance are held",
                at_offsets(offsets, names), partial(_around, offsets)),
    ]


def _at_frame(view: View, start: int, pad: int) -> Any:
    """Between the two outputs (B, 384) on either side of the frame's centre."""
    return _told(view, view.frames)


def _around(offsets: tuple[int, ...], view: View, start: int, pad: int) -> Any:
    """Those at frames around, (B, offsets x 384); beyond the utterance those of its first or last frame."""
    shift = view.constant(("offsets", offsets), lambda: np.array(offsets, dtype=np.int64))
    low, high = view.frame_bounds(view.utterance)
    places = view.xp.clip(view.frames[:, None] + shift, low[:, None], high[:, None] - 1)
    return _told(view, places).reshape(len(places), -1)


def _told(view: View, frames: Any) -> Any:
    before, share = view.wide("encoder_before", frames), view.rows("encoder_share", frames)
    low, high = (view.cast(view.rows("encoder", place), "float32") for place in (before, before + 1))
    return low + share[..., None] * (high - low)


def _encode(recording: Recording, settings: Settings, clock: FrameClock, frames: int) -> dict[str, Any]:
    sound, first = heard(recording, clock)
    made = settings.encoder
    outputs = normalised(encoder_outputs(sound, made), settings.sound_norm, SPREAD, RATE / STEP, lambda: talker_moments(
        sound, lambda other: encoder_outputs(other, made), made, SPREAD))
    before, share = places_of(clock, first + np.arange(frames), len(outputs))
    return {"encoder": outputs, "encoder_before": before, "encoder_share": share}


def _facts(settings: Settings, clock: FrameClock) -> str:
    at = ", ".join(f"{1000 * clock.seconds(offset):+g}" for offset in settings.encoder_offsets)
    ahead = settings.encoder.lookahead
    heard = "the whole recording" if ahead is None else f"{1000 * ahead:g} ms behind a moment at most"
    return f"Encoder: it hears {heard}; 384 columns, and those at {at or 'no other'} ms."


ENCODER_SOURCE = FeatureSource(
    name="encoder",
    needs=frozenset({"sound"}),
    fields=_fields,
    blocks=_blocks,
    encode=_encode,
    absent=("needs the sound, and there is none", "Encode recordings with their sound"),
    facts=_facts,
    key=lambda settings: settings.encoder.key + settings.norm,
)
