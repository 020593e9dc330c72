"""The sound as log-mel energies: dense columns, of the frame itself and of a few frames around."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from dnnvss.acoustics import log_mel
from dnnvss.errors import DnnvssError
from dnnvss.features.block import Block, Settings, at_offsets, numeric
from dnnvss.features.fields import Field
from dnnvss.features.recording import Recording
from dnnvss.features.sources.base import FeatureSource
from dnnvss.features.view import View
from dnnvss.timing import FrameClock

_UNIT = "ln of power"
_PAPER = "Davis and Mermelstein 1980, mel bands"


def _bands(settings: Settings) -> tuple[str, ...]:
    return tuple(f"mel{band:02d}" for band in range(1, settings.logmel.bands + 1))


def _fields(settings: Settings) -> Mapping[str, Field]:
    return {"logmel": Field("frame", np.float32, _bands(settings))}


def _blocks(settings: Settings) -> list[Block]:
    made, names = settings.logmel, _bands(settings)
    what = (f"in mel bands from {made.low:g} to {made.high:g} Hz, {made.window:g} ms of sound around its centre "
            f"(log-mel {made.key})")
    return [
        numeric("logmel", "frame", ("logmel",), _UNIT, _PAPER, f"the power of this frame {what}", names, at_frame),
        numeric("logmel_window", "frame", ("logmel",), _UNIT, _PAPER,
                f"the power of a few frames around {what}; the ends of the utterance are held",
                at_offsets(settings.logmel_offsets, names), partial(around, settings.logmel_offsets)),
    ]


def at_frame(view: View, start: int, pad: int) -> Any:
    """The energies of this frame."""
    return view.rows("logmel", view.frames)


def around(offsets: tuple[int, ...], view: View, start: int, pad: int) -> Any:
    """The energies at frames around, (B, offsets x bands); beyond the utterance those of its first or last frame."""
    shift = view.constant(("offsets", offsets), lambda: np.array(offsets, dtype=np.int64))
    low, high = view.frame_bounds(view.utterance)
    places = view.xp.clip(view.frames[:, None] + shift, low[:, None], high[:, None] - 1)
    return view.rows("logmel", places).reshape(len(places), -1)


def _encode(recording: Recording, settings: Settings, clock: FrameClock, frames: int) -> dict[str, Any]:
    sound = recording.sound
    assert sound is not None
    first, last = recording.span(clock)
    if sound.seconds < clock.seconds((first + last) // 2):
        raise DnnvssError(f"the sound lasts {sound.seconds:.2f} s and the alignment {clock.seconds(last):.2f} s",
                          remedy="Give the recording that the times belong to")
    return {"logmel": log_mel(sound, settings.logmel, clock, first, frames)}


def _facts(settings: Settings, clock: FrameClock) -> str:
    at = ", ".join(f"{1000 * clock.seconds(offset):+g}" for offset in settings.logmel_offsets)
    made = settings.logmel
    return f"Sound: {made.bands} bands of {made.window:g} ms of sound, and those at {at or 'no other'} ms."


LOGMEL_SOURCE = FeatureSource(
    name="logmel",
    needs=frozenset({"sound"}),
    fields=_fields,
    blocks=_blocks,
    encode=_encode,
    absent=("needs the sound, and there is none", "Encode recordings with their sound"),
    facts=_facts,
    key=lambda settings: settings.logmel.key,
)
