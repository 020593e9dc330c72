"""From an alignment, its text and its sound to frame codes."""

from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.features.codes import FrameCodes
from dnnvss.features.recording import Recording
from dnnvss.features.sources import SOURCES, array_fields
from dnnvss.features.table import FeatureTable
from dnnvss.media import Sound
from dnnvss.timing import Alignment, FrameClock


def encode(alignment: Alignment, text: str, table: FeatureTable, clock: FrameClock,
           sound: Sound | None = None) -> FrameCodes:
    """The frame codes of an utterance; frame 0 begins where the alignment begins.

    Args:
        alignment: the tiers that the table reads: ``phones`` and ``words``; ``visemes`` with labels that are numbers.
        text: the words as written.
        table: the columns to serve.
        clock: frame rate.
        sound: what is heard, if the table reads it; its time 0 is that of the alignment.

    Raises:
        DnnvssError: a tier or the sound is missing, a phone or unit is unknown, the alignment is shorter than a frame,
            or a segment is longer than 65,535 frames.
    """
    return encode_recording(Recording(alignment, text, sound), table, clock)


def encode_recording(recording: Recording, table: FeatureTable, clock: FrameClock) -> FrameCodes:
    """The frame codes of a recording, which may be a sound alone; see :func:`encode`."""
    first, last = recording.span(clock)
    if "sound" in table.needs and recording.sound is None:
        raise DnnvssError(f"{table.title} reads the sound, and there is none",
                          remedy="Give wav=FILE, or let an engine speak: speech=auto")
    sources = [s for s in SOURCES.values() if s.name in table.sources or (s.always and s.encodes(recording))]
    arrays: dict[str, Any] = {"utterance_start": [0], "utterance_frames": [last - first]}
    for source in sources:
        arrays |= source.encode(recording, table.settings, clock, last - first)
    declared = array_fields((s.name for s in sources), table.settings)
    typed: dict[str, Any] = {name: np.asarray(arrays[name]).astype(field.dtype) for name, field in declared.items()}
    keys = {s.name: key for s in sources if (key := s.key(table.settings))}
    return FrameCodes(table, typed, str(clock), keys)
