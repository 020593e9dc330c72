"""What the headers of recordings say: length, size, rate and coding, without reading them."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeVar

import av
import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.media import SPEECH_RATE, opened, write_video
from dnnvss.media.decoding import decoded

Item = TypeVar("Item")
_QUALITY = 12
_REMEDY = "Check that it plays"


@dataclass(frozen=True)
class Header:
    """What a recording says of itself.

    Args:
        seconds: its length, 0 where it does not tell.
        pictures: size, rate and coding as they are shown to a reader; empty where there are none.
        sound: coding, sampling rate, channels and tracks; empty where there is none.
    """

    seconds: float
    pictures: str = ""
    sound: str = ""


def header(path: Path) -> Header:
    """The header of a recording.

    Raises:
        DnnvssError: it is none, or cannot be read.
    """

    def read(p: Path) -> Header:
        with opened(p) as container:
            video, sound = container.streams.video, container.streams.audio
            pictures = f"{video[0].width} x {video[0].height}, {_rate(video[0])}, {video[0].name}" if video else ""
            tracks = f", {len(sound)} tracks" if len(sound) > 1 else ""
            heard = f"{sound[0].name}, {sound[0].rate} Hz, {_channels(sound[0])}{tracks}" if sound else ""
            return Header(_seconds(container), pictures, heard)

    found: Header = files.read(path, read, _REMEDY)
    return found


def headers(paths: Mapping[str, Path], until: float) -> tuple[dict[Path, Header], dict[str, str]]:
    """The headers of as many recordings as can be read until a moment, and why others cannot be read.

    Args:
        paths: of recordings, by id; those that are read are spread over all.
        until: the moment (:func:`time.monotonic`).
    """
    found: dict[Path, Header] = {}
    problems: dict[str, str] = {}
    for name in spread(list(paths), len(paths)):
        try:
            found[paths[name]] = header(paths[name])
        except ShortageError:
            raise
        except DnnvssError as error:
            problems[name] = str(error)
        if time.monotonic() > until:
            break
    return found, problems


def spread(items: Sequence[Item], count: int) -> list[Item]:
    """The first so many of all items in an order in which the first few are spread over all."""
    order = sorted(range(len(items)), key=lambda k: (k * 0.6180339887498949) % 1)
    return [items[k] for k in order[:count]]


def cut(video: Path, sound: Path | None, start: float, seconds: float, out: Path) -> int:
    """Write some seconds of a recording as a short one, ``out`` (``.mp4``); returns the number of its pictures.

    Args:
        video: the recording.
        sound: where its sound is, if that is not in the video.
        start: seconds at which to begin.
        seconds: how long.
        out: the short recording.

    Raises:
        DnnvssError: it cannot be read, or has no picture there.
    """
    pictures, pixel = files.read(video, lambda p: _pictures(p, start, seconds), _REMEDY)
    if not pictures:
        raise DnnvssError(f"has no picture at {start:.0f} s", file=video, remedy=_REMEDY)
    first, last = pictures[0][0], pictures[-1][0]
    rate = Fraction((len(pictures) - 1) / (last - first)).limit_denominator(1001) if last > first else Fraction(25)
    samples = files.read(sound or video, lambda p: _sound(p, first, len(pictures) / float(rate)), _REMEDY)
    write_video(out, (picture for _, picture in pictures), rate, samples, SPEECH_RATE, _QUALITY, pixel)
    return len(pictures)


def _pictures(path: Path, start: float, seconds: float) -> tuple[list[tuple[float, np.ndarray]], Fraction]:
    """Time and picture, upright, from a moment on, and the shape of a pixel."""
    found, pixel = list[tuple[float, np.ndarray]](), Fraction(1)
    with opened(path) as container:
        _seek(container, start)
        for stamp, frame, look in decoded(container):
            time = start + len(found) / 25 if stamp is None else stamp
            if time >= start:
                found.append((time, look.upright(frame.to_ndarray(format="rgb24"))))
                pixel = look.upright_pixel
            if found and time - found[0][0] >= seconds - 1e-6:
                break
    return found, pixel


def _sound(path: Path, start: float, seconds: float) -> np.ndarray | None:
    """The first track of sound from a moment on, mono (n,), None where there is none."""
    parts, count = list[np.ndarray](), 0
    with opened(path) as container:
        if not container.streams.audio:
            return None
        _seek(container, start)
        made = av.AudioResampler("fltp", "mono", SPEECH_RATE)
        for frame in container.decode(container.streams.audio[0]):
            if (frame.time or 0.0) < start - frame.samples / frame.sample_rate:
                continue
            parts += [part.to_ndarray()[0] for part in made.resample(frame)]
            if (count := sum(map(len, parts))) > seconds * SPEECH_RATE:
                break
    return np.concatenate(parts)[: round(seconds * SPEECH_RATE)] if count else None


def _seek(container: av.container.InputContainer, start: float) -> None:
    if start > 0:
        container.seek(round(start * av.time_base), backward=True)


def _seconds(container: av.container.InputContainer) -> float:
    return float(container.duration / av.time_base) if container.duration else 0.0


def _rate(stream: Any) -> str:
    rate = stream.average_rate or stream.guessed_rate or stream.base_rate
    return f"{float(rate):.4g} pictures a second" if rate else "no rate"


def _channels(stream: Any) -> str:
    count = stream.codec_context.channels
    return {1: "mono", 2: "stereo"}.get(count, f"{count} channels")
