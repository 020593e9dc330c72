"""Recordings without video: landmarks whose time stamps tell the rate, and a sound beside them."""

from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from data_prep.landmarks import read_all
from data_prep.media import SILENT, laid
from dnnvss.errors import DnnvssError
from dnnvss.formats import check_times, common_rate, stamped
from dnnvss.media import SPEECH_RATE, read_audio, write_wav
from dnnvss.timing import FrameClock

Results = Mapping[str, Mapping[str, Any]]


def measured(name: str, out: Path, landmarks: tuple[Path, ...], dimensions: int) -> dict[str, Any]:
    """How many frames the landmarks of a recording have, and frames and seconds between their time stamps.

    Args:
        name: the utterance id; not used.
        out: the prepared corpus; not used.
        landmarks: as in :func:`data_prep.landmarks.read_raw`.
        dimensions: coordinates of a point.
    """
    found = read_all(landmarks, 1.0, dimensions)
    return {"frames": len(found.points), "span": stamped(found, landmarks[0])}


def told_rate(counted: Results, given: str | None, filmed: Fraction | None) -> tuple[FrameClock, str]:
    """The frame rate of recordings without video, and where it is from, in words.

    Args:
        counted: results of :func:`measured`.
        given: by the user, before all else.
        filmed: of the recordings that have a video, taken where there are no time stamps.

    Raises:
        DnnvssError: nothing tells it.
    """
    if given is not None:
        return FrameClock(given), "as given"
    stamps = common_rate([(f, s) for f, s in (c["span"] for c in counted.values() if c["span"])])
    if stamps is not None:
        return stamps, "told by time stamps"
    if filmed is not None:
        return FrameClock(filmed), "that of the videos"
    raise DnnvssError("the frame rate of landmarks without video is not known",
                      remedy="Give it as corpus.importer.rate=25, or as \"rate\" in landmarks.json")


def sounded(name: str, out: Path, landmarks: tuple[Path, ...], dimensions: int, frames: int, rate: str,
            stamps: bool, sound: Path | None, delay: float) -> dict[str, Any]:
    """What is known of a recording without video, after its sound was laid on the time of its landmarks.

    The sound is written to ``out/.stages/sound/<id>.wav`` as :func:`data_prep.media.media` does.

    Args:
        name: the utterance id.
        out: the prepared corpus.
        landmarks, dimensions: as in :func:`measured`.
        frames: of the landmarks.
        rate: frames a second.
        stamps: the rate is that of time stamps, which must keep to it.
        sound: a file, or None.
        delay: seconds by which the sound is late.

    Raises:
        DnnvssError: the sound cannot be read or is silence, or the time stamps are not of one rate.
    """
    if stamps:
        check_times(read_all(landmarks, 1.0, dimensions), FrameClock(rate), landmarks[0])
    known = {"frames": frames, "rate": rate, "size": [0, 0], "video": None}
    if sound is None:
        return {**known, "sound": None}
    samples = laid(read_audio(sound, SPEECH_RATE), delay, round(float(frames / Fraction(rate)) * SPEECH_RATE))
    if np.abs(samples).max(initial=0.0) < SILENT:
        raise DnnvssError("its sound is silence", file=sound, utterance=name, remedy="Give a recording with speech")
    copied = write_wav(out / ".stages" / "sound" / f"{name}.wav", samples, SPEECH_RATE)
    return {**known, "sound": str(copied.relative_to(out))}
