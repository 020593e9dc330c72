"""Recordings whose words nobody wrote down: where somebody speaks is all that is known of their phones."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from data_prep.recipe import Source
from data_prep.stages import FOLDER, Workshop
from dnnvss.formats import write_alignment
from dnnvss.media import SPEECH_RATE, Sound, read_audio
from dnnvss.phones import SILENCE
from dnnvss.speech.activity import SPEECH, voice_activity
from dnnvss.timing import Alignment, Segment, Tier

SOMETHING = "AH"
"""The phone that stands for speech of which nothing else is known: the neutral vowel."""
_LENGTH = 0.2
"""Seconds that such a phone lasts about."""
NOTE = f"no words: stretches in which somebody speaks stand as {SOMETHING}; train on labels of the voice alone"


def speech_alone(source: Source, shop: Workshop) -> Source:
    """The source with phone times that tell speech from silence, heard in its sound.

    They are written to ``out/.stages/untold/<id>.TextGrid``, where they are not there yet.

    Raises:
        DnnvssError: the sound cannot be read.
    """
    assert source.sound is not None
    path = shop.out / FOLDER / "untold" / f"{source.id}.TextGrid"
    if not path.is_file() or path.stat().st_mtime < source.sound.stat().st_mtime:
        write_alignment(path, heard_speech(source.sound))
    return replace(source, alignment=path, notes=(*source.notes, NOTE))


def _parted(s: Segment) -> list[Segment]:
    if s.label != SPEECH:
        return [s._replace(label=SILENCE)]
    edges = np.linspace(s.start, s.end, max(1, round(s.duration / _LENGTH)) + 1).tolist()
    return [Segment(a, b, SOMETHING) for a, b in pairwise(edges)]


def heard_speech(sound: Path) -> Alignment:
    """The tiers ``phones``, :data:`SOMETHING` and silence, and ``words``, none, of a sound file.

    A stretch of speech is parted evenly, so that no phone is longer than phones are.
    """
    tier = voice_activity(Sound(read_audio(sound, SPEECH_RATE), SPEECH_RATE))
    phones = Tier("phones", [part for s in tier for part in _parted(s)])
    return Alignment([phones, Tier("words", [(tier.start, tier.end, "")])])
