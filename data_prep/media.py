"""One recording: its pictures counted and made small, its sound laid on the time line of its pictures."""

import shutil
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.corpus import checkup
from dnnvss.errors import DnnvssError
from dnnvss.media import SPEECH_RATE, opened, read_audio, video_info, write_wav

_REMEDY = "Convert the file to MP4 (H.264, AAC) and check that it plays"

LATE = 1.5
"""Frames by which a picture's time stamp may differ from a constant rate."""

SILENT = 1e-3
"""Largest sample of a recording that is taken to have no sound in it."""


def media(name: str, video: Path, out: Path, delay: float) -> dict[str, Any]:
    """Return what is known of a recording after copying it to ``out/video`` and its sound to ``out/.stages/sound``.

    The sound is written as 16 kHz mono, exactly as long as the pictures, its first sample at the start of the first
    picture. Thumbnails of the pictures go to ``out/.stages/media/<id>.npz``.

    Args:
        name: the utterance id.
        video: the recording.
        out: the prepared corpus.
        delay: seconds by which the sound of the file is late, beyond what the file itself says.

    Raises:
        DnnvssError: the video cannot be read, has no sound or only silence.
    """
    info = video_info(video)
    if not info.has_audio:
        raise DnnvssError("has no sound", file=video, utterance=name, remedy="Give a recording with an audio stream")
    small = files.read(video, lambda path: _pictures(path, info.rate), _REMEDY)
    duration = float(len(small) / info.rate)
    sound = laid(read_audio(video, SPEECH_RATE), delay - sound_start(video), round(duration * SPEECH_RATE))
    if np.abs(sound).max(initial=0.0) < SILENT:
        raise DnnvssError("its sound is silence", file=video, utterance=name, remedy="Give a recording with speech")
    copy = out / "video" / f"{name}{video.suffix.lower()}"
    with files.replacing(copy) as temporary:
        shutil.copyfile(video, temporary)
    copied = write_wav(out / ".stages" / "sound" / f"{name}.wav", sound, SPEECH_RATE)
    files.write_arrays(out / ".stages" / "media" / f"{name}.npz", thumbnails=small)
    return {"frames": len(small), "rate": str(info.rate), "size": list(info.size),
            "video": str(copy.relative_to(out)), "sound": str(copied.relative_to(out))}


def _pictures(video: Path, rate: Fraction) -> np.ndarray:
    """Return thumbnails of all pictures, read one at a time so that a long recording needs no more memory.

    Raises:
        DnnvssError: no picture, pictures that the file tells to be turned, or a frame rate that is not constant.
    """
    small, first = [], None
    with opened(video) as container:
        container.streams.video[0].thread_type = "AUTO"
        for index, frame in enumerate(container.decode(video=0)):
            if frame.rotation % 360:
                raise DnnvssError(f"its pictures are to be turned by {frame.rotation} degrees", file=video,
                                  remedy="Convert it upright: ffmpeg -i FILE OUT.mp4")
            first = frame.time if first is None else first
            late = (frame.time - first) * float(rate) - index if frame.time is not None and first is not None else 0.0
            if abs(late) > LATE:
                raise DnnvssError(f"frame {index} comes {late:.1f} frames late at {float(rate):g} a second", file=video,
                                  remedy="Convert it to a constant rate: ffmpeg -i FILE -r 25 OUT.mp4")
            small.append(checkup.thumbnails(frame.to_ndarray(format="rgb24")[None])[0])
    if not small:
        raise DnnvssError("holds no frame", file=video, remedy=_REMEDY)
    return np.stack(small)


def sound_start(video: Path) -> float:
    """Return the seconds from the start of the first picture to the first sample, as the file's time stamps say."""
    starts = []
    for kind in ("audio", "video"):
        with opened(video) as container:
            frames: Any = container.decode(**{kind: 0})
            time = next((frame.time for frame in frames), None)
            starts.append(time or 0.0)
    return float(starts[0] - starts[1])


def laid(sound: np.ndarray, late: float, count: int) -> np.ndarray:
    """Return ``count`` samples of a sound that is ``late`` seconds late: cut at the start, or silence put before."""
    shift = round(late * SPEECH_RATE)
    moved = sound[shift:] if shift >= 0 else np.concatenate([np.zeros(-shift, np.float32), sound])
    return np.pad(moved[:count], (0, max(0, count - len(moved))))
