"""Reading and writing video and sound through PyAV and scipy."""

import wave
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from av.video.reformatter import VideoReformatter

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.media.cells import Cells
from dnnvss.media.containers import opened
from dnnvss.media.decoding import Look, decoded, look_of, main_stream
from dnnvss.media.folders import SOUNDS
from dnnvss.media.hearing import mixed, mono
from dnnvss.media.sound import LOUDEST
from dnnvss.shortages import shortage_of

SPEECH_RATE = 16000
"""Samples a second at which speech is analysed: prepared corpora, alignment, acoustics."""

_BLOCK = 2**20  # samples that are written at once

SOUND_RATE = 48000
"""Samples a second of the sound of videos that are written."""

_REMEDY = ("Check that it plays, then store it anew, frame for frame: "
           "ffmpeg -i FILE -fps_mode passthrough -c:v libx264 -crf 12 -c:a aac OUT.mp4")

_SOUND_REMEDY = ("Check that it plays, then store it anew: ffmpeg -i FILE OUT.wav; raw samples: "
                 "ffmpeg -f s16le -ar 16000 -ac 1 -i FILE OUT.wav")
_RAW = ".raw", ".pcm", ".s16", ".au", ".oga", ".amr"


@dataclass(frozen=True)
class VideoInfo:
    """What is known of a video before it is read.

    Args:
        size: width and height of the upright picture in pixels.
        rate: frames a second, as the file says.
        has_audio: whether there is sound.
        pixel: width of a pixel of the upright picture over its height.
        plain: the pictures are stored as they are shown: upright, of whole frames, their pixels square.
        told: frame rates that the file tells of its clock, the likeliest first; ``rate`` is an average.
        tracks: of sound.
        seconds: its length, as the header tells; 0 where it does not, or only by a guess.
    """

    size: tuple[int, int]
    rate: Fraction
    has_audio: bool
    pixel: Fraction = Fraction(1)
    plain: bool = True
    told: tuple[Fraction, ...] = ()
    tracks: int = 1
    seconds: float = 0.0


_LASTING = {"matroska", "mov", "avi", "asf"}
"""Containers whose header tells their length."""


def video_info(path: str | Path) -> VideoInfo:
    """What a video file's header and its first picture say.

    Raises:
        DnnvssError: the file is missing, unreadable or has no picture.
    """

    def probe(p: Path) -> VideoInfo:
        with opened(p) as container:
            stream = _pictured(container, p)
            rate = stream.average_rate or stream.guessed_rate or stream.base_rate
            if not rate or not stream.width:
                raise DnnvssError("does not say its frame rate or size", file=p, remedy=_REMEDY)
            frame = next(container.decode(stream), None)
            look = look_of(frame, stream) if frame is not None else Look()
            told = tuple(Fraction(r) for r in (stream.guessed_rate, stream.base_rate) if r)
            plain = not look.turned and not look.interlaced and look.pixel == 1
            known = _LASTING & set(container.format.name.split(",")) and container.duration
            return VideoInfo(look.shown_size(stream.width, stream.height), Fraction(rate),
                             bool(container.streams.audio), look.upright_pixel, plain, told,
                             len(container.streams.audio), known / av.time_base if known else 0.0)

    found: VideoInfo = files.read(path, probe, _REMEDY)
    return found


def read_video(path: str | Path) -> np.ndarray:
    """All frames of a video, upright, uint8 RGB, shape (F, H, W_, 3).

    Raises:
        DnnvssError: the file is missing, unreadable or holds no frame.
    """

    def decode(p: Path) -> np.ndarray:
        with opened(p) as container:
            _pictured(container, p)
            scaler = VideoReformatter()  # one for all frames: each would make its own
            frames = [look.upright(scaler.reformat(frame, format="rgb24").to_ndarray())
                      for _, frame, look in decoded(container)]
        if not frames:
            raise DnnvssError("holds no frame", file=p, remedy=_REMEDY)
        return np.stack(frames)

    return files.read(path, decode, _REMEDY)


def video_frames(path: str | Path, size: tuple[int, int] | None = None, grey: bool = False) -> Iterator[np.ndarray]:
    """Yield the frames of a video one after the other, upright, uint8 RGB (H, W_, 3) or, where ``grey``, luminance.

    Args:
        path: the file; long videos are never held as a whole.
        size: width and height to which frames are scaled; as they are where None.
        grey: yield luminance (H, W_).

    Raises:
        DnnvssError: the file is missing, unreadable, breaks off or holds no frame.
    """
    return (image for _, image in timed_frames(path, size, grey))


def timed_frames(path: str | Path, size: tuple[int, int] | None = None,
                 grey: bool = False) -> Iterator[tuple[float | None, np.ndarray]]:
    """Yield time stamp in seconds, None where the file has none, and picture of each frame as :func:`video_frames`."""
    form, scaler = "gray" if grey else "rgb24", VideoReformatter()  # one for all frames: each would make its own

    def shown(frame: Any, look: Look) -> np.ndarray:
        width, height = look.shown_size(*size) if size else (None, None)
        return look.upright(scaler.reformat(frame, width, height, form).to_ndarray())

    return _timed(path, shown)


def timed_cells(path: str | Path, columns: int, rows: int) -> Iterator[tuple[float | None, np.ndarray]]:
    """Yield time stamp and mean colours (rows, columns, 3) uint8 RGB of each frame's cells: see :class:`Cells`.

    Raises:
        DnnvssError: the file is missing, unreadable, breaks off or holds no frame.
    """
    return _timed(path, Cells(columns, rows))


def _timed(path: str | Path, shown: Callable[[Any, Look], np.ndarray]) -> Iterator[tuple[float | None, np.ndarray]]:
    """Yield time stamp of each frame and what is made of it."""
    container = files.read(path, opened, _REMEDY)
    with container:
        _pictured(container, Path(path))
        count = 0
        try:
            for time, frame, look in decoded(container):
                count += 1
                yield time, shown(frame, look)
        except av.FFmpegError as error:
            if (short := shortage_of(error, path)) is not None:
                raise short from error
            raise DnnvssError(f"breaks off after {count} frames ({error})", file=path, remedy=_REMEDY) from error
        if not count:
            raise DnnvssError("holds no frame", file=path, remedy=_REMEDY)


def _pictured(container: av.container.InputContainer, path: Path) -> Any:
    """The stream of pictures."""
    if not container.streams.video:
        raise DnnvssError("has no video stream", file=path, remedy="Give a recording with pictures")
    return main_stream(container)


def read_audio(path: str | Path, rate: int = SPEECH_RATE) -> np.ndarray:
    """The sound of a wav or video file, mono float32 (samples,) in [-1, 1] at ``rate`` samples a second.

    Which track and channels are heard, and what stands in gaps, :func:`dnnvss.media.hearing.mono` says.

    Raises:
        DnnvssError: the file is missing, unreadable or has no sound, or samples that are none.
    """
    return timed_audio(path, rate)[0]


def timed_audio(path: str | Path, rate: int = SPEECH_RATE) -> tuple[np.ndarray, float]:
    """The sound as :func:`read_audio` gives it, and the time stamp of its first sample in seconds."""

    def decode(p: Path) -> tuple[np.ndarray, float]:
        if (plain := _plain_wav(p, rate)) is not None:
            return mixed(plain[None]), 0.0
        with opened(p) as container:
            if not container.streams.audio:
                raise DnnvssError("has no sound", file=p, remedy="Give a recording with an audio stream")
            tracks = len(container.streams.audio)
        sound, start = mono(p, tracks, rate)
        if not len(sound):
            raise DnnvssError("its sound is empty", file=p, remedy="Give a recording with an audio stream")
        _check_level(sound, p)
        return sound, start

    remedy = _SOUND_REMEDY if Path(path).suffix.lower() in (*SOUNDS, *_RAW) else _REMEDY
    found: tuple[np.ndarray, float] = files.read(path, decode, remedy)
    return found


def _check_level(sound: np.ndarray, path: Path) -> None:
    """Refuse samples that are far beyond full scale."""
    if (loudest := max(-float(sound.min()), float(sound.max()))) > LOUDEST:
        raise DnnvssError(f"its samples reach {loudest:g}, and 1 is full scale", file=path,
                          remedy="Write the recording anew, with samples of at most 1")


def _plain_wav(path: Path, rate: int) -> np.ndarray | None:
    """The samples (n,) of a file as :func:`write_wav` writes it at this rate, whole and of some length, else None.

    They are those that FFmpeg decodes, in a tenth of the time.
    """
    if path.suffix.lower() != ".wav":
        return None
    try:
        with wave.open(str(path), "rb") as sound:
            if (sound.getnchannels(), sound.getsampwidth(), sound.getframerate()) != (1, 2, rate):
                return None
            data = sound.readframes(count := sound.getnframes())
    except (wave.Error, EOFError, RuntimeError):  # the last where a part is said to be longer than the file
        return None
    return np.frombuffer(data, "<i2").astype(np.float32) / 32768 if len(data) == 2 * count > 0 else None


def write_wav(path: str | Path, samples: np.ndarray, rate: int) -> Path:
    """Write mono float samples (n,) in [-1, 1] as 16-bit PCM and return the path; louder samples are clipped."""
    with files.replacing(path) as temporary, wave.open(str(temporary), "wb") as sound:
        sound.setparams((1, 2, rate, len(samples), "NONE", ""))
        for start in range(0, len(samples), _BLOCK):
            block = np.clip(samples[start : start + _BLOCK], -1, 1) * 32767
            sound.writeframesraw(block.astype("<i2").tobytes())
            files.forget(samples[start : start + _BLOCK])
    return Path(path)
