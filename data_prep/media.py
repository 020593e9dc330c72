"""One recording: its pictures counted and made small, its sound laid on the time line of its pictures."""

from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.corpus import checkup
from dnnvss.errors import DnnvssError
from dnnvss.media import SPEECH_RATE, read_audio, timed_audio, timed_cells, video_info, write_wav
from dnnvss.timing.rates import rate_of, rising

SILENT = 1e-3
"""Largest sample of a recording that is taken to have no sound in it."""


def media(name: str, video: Path, out: Path, delay: float, sound: Path | None = None) -> dict[str, Any]:
    """What is known of a recording, after writing its sound to ``out/.stages/sound``.

    The sound is written as 16 kHz mono, exactly as long as the pictures, its first sample at the start of the first
    picture. Thumbnails of the pictures and their time stamps go to ``out/.stages/media/<id>.npz``.

    Args:
        name: the utterance id.
        video: the recording.
        out: the prepared corpus.
        delay: seconds by which the sound of the file is late, beyond what the file itself says.
        sound: a file that begins with the first picture, taken where the video has no sound of its own.

    Returns:
        ``frames`` of the file and their ``rate``; ``size`` of the upright picture and shape of its ``pixel``; whether
        it is ``plain``; the path of the ``sound``, the seconds at which it ``starts`` after the first picture and
        ``ends`` after the last one; the seconds that it ``lasts``, and those that it ``lacks`` of what it says; how
        many ``tracks`` of sound there are, and which share of it is ``clipped``; the name of a sound that is to
        ``spare``.

    Raises:
        DnnvssError: the video cannot be read, has no sound or only silence.
    """
    info = video_info(video)
    if not info.has_audio and sound is None:
        raise DnnvssError("has no sound", file=video, utterance=name,
                          remedy=f"Give a recording with an audio stream, or put {name}.wav beside it")
    times, small = _pictures(video)
    rate = rate_of(seconds := rising(times, info.told[0] if info.told else info.rate), info.told)
    heard = heard_in(video, sound)
    spare = sound.name if sound is not None and heard == video else ""
    samples, first = timed_audio(heard, SPEECH_RATE)
    starts = first - (times[0] or 0.0) if heard == video else 0.0
    duration = float(seconds[-1]) + float(1 / rate)
    moved = laid(samples, delay - starts, round(duration * SPEECH_RATE))
    if np.abs(moved).max(initial=0.0) < SILENT:
        raise DnnvssError("its sound is silence", file=heard, utterance=name, remedy="Give a recording with speech")
    if (top := float(np.abs(moved).max())) > OVER:
        moved = moved / np.float32(top)  # floats, of which a file of 16 bits would keep no peak
    copied = write_wav(out / ".stages" / "sound" / f"{name}.wav", moved, SPEECH_RATE)
    files.write_arrays(out / ".stages" / "media" / f"{name}.npz", thumbnails=small, times=seconds)
    ends = starts - delay + len(samples) / SPEECH_RATE - duration
    lasts = max(duration, starts + len(samples) / SPEECH_RATE) - min(starts, 0.0) if heard == video else duration
    return {"frames": len(small), "rate": str(rate), "size": list(info.size), "pixel": str(info.pixel),
            "plain": info.plain, "starts": round(starts, 5), "ends": round(ends, 2),
            "tracks": info.tracks if heard == video else 1, "clipped": round(clipped(moved), 3),
            "lasts": round(lasts, 2), "lacks": round(max(info.seconds - lasts, 0.0), 2),
            "sound": str(copied.relative_to(out)), "spare": spare}


OVER = 1.1
"""Sample beyond full scale from which a sound is made softer as a whole."""
CLIPPED = 0.01
"""Share of samples at the top from which a recording is called clipped; of loud speech that is not it is .004."""


def clipped(sound: np.ndarray) -> float:
    """The share of the samples (n,) of a loud recording that are at its top; 0 of one that stays below full scale."""
    top = float(np.abs(sound).max(initial=0.0))
    return float((np.abs(sound) > 0.95 * top).mean()) if top > 0.9 else 0.0


def heard_in(video: Path, sound: Path | None) -> Path:
    """The file whose sound a recording has: its video, or the one beside it where the video has none or silence."""
    if sound is None or not video_info(video).has_audio:
        return sound or video
    return video if np.abs(read_audio(video, SPEECH_RATE)).max(initial=0.0) >= SILENT else sound


def _pictures(video: Path) -> tuple[list[float | None], np.ndarray]:
    """Time stamps and thumbnails of all pictures, read one at a time so that a long recording needs no more memory."""
    times, small = list[float | None](), list[np.ndarray]()
    for time, image in timed_cells(video, *checkup.THUMBNAIL):
        times.append(time)
        small.append(image)
    return times, np.stack(small)


def laid(sound: np.ndarray, late: float, count: int, rate: int = SPEECH_RATE) -> np.ndarray:
    """``count`` samples of a sound that is ``late`` seconds late: cut at the start, or silence put before."""
    shift = round(late * rate)
    moved = sound[shift:] if shift >= 0 else np.concatenate([np.zeros(-shift, np.float32), sound])
    return np.pad(moved[:count], (0, max(0, count - len(moved))))
