"""Reading and writing video and sound through PyAV and scipy."""

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import scipy.io.wavfile

from dnnvss import files
from dnnvss.errors import DnnvssError

SPEECH_RATE = 16000
"""Samples a second at which speech is analysed: prepared corpora, alignment, acoustics."""

SOUND_RATE = 48000
"""Samples a second of the sound of videos that are written."""

_REMEDY = "Convert the file to MP4 (H.264, AAC) and check that it plays"


_CONTAINERS = (
    "3g2", "3gp", "aac", "ac3", "aiff", "amr", "ape", "apng", "asf", "au", "avi", "caf", "dv", "eac3",
    "flac", "flv", "gif", "h264", "hevc", "ivf", "m4a", "m4v", "matroska", "mj2", "mjpeg", "mov", "mp3",
    "mp4", "mpc", "mpc8", "mpeg", "mpegts", "mpegvideo", "mxf", "nistsphere", "nut", "obu", "ogg", "rm",
    "sox", "tak", "tta", "voc", "w64", "wav", "webm", "wtv", "wv", "yuv4mpegpipe")
"""What is read: files that hold their own pictures and sound. Playlists (HLS, DASH, concat, SDP) name other files and
addresses, and come in files of any name."""


def opened(path: str | Path) -> av.container.InputContainer:
    """A recording, opened; it reads nothing but its own file.

    Raises:
        FFmpegError: it is no recording, or a list of other files.
    """
    only = {"format_whitelist": ",".join(_CONTAINERS), "protocol_whitelist": "file"}
    return av.open(str(path), container_options=only)


@dataclass(frozen=True)
class VideoInfo:
    """Width and height in pixels, frame rate, and whether there is sound."""

    size: tuple[int, int]
    rate: Fraction
    has_audio: bool


def video_info(path: str | Path) -> VideoInfo:
    """Return what a video file's header says.

    Raises:
        DnnvssError: the file is missing, unreadable or has no picture.
    """

    def probe(p: Path) -> VideoInfo:
        with opened(p) as container:
            if not container.streams.video:
                raise DnnvssError("has no video stream", file=p, remedy=_REMEDY)
            stream = container.streams.video[0]
            rate = stream.average_rate or stream.guessed_rate or stream.base_rate
            if not rate or not stream.width:
                raise DnnvssError("does not say its frame rate or size", file=p, remedy=_REMEDY)
            return VideoInfo((stream.width, stream.height), Fraction(rate), bool(container.streams.audio))

    return files.read(path, probe, _REMEDY)


def read_video(path: str | Path) -> np.ndarray:
    """Return all frames of a video, uint8 RGB, shape (F, H, W_, 3).

    Raises:
        DnnvssError: the file is missing, unreadable or holds no frame.
    """

    def decode(p: Path) -> np.ndarray:
        with opened(p) as container:
            if not container.streams.video:
                raise DnnvssError("has no video stream", file=p, remedy=_REMEDY)
            container.streams.video[0].thread_type = "AUTO"
            frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
        if not frames:
            raise DnnvssError("holds no frame", file=p, remedy=_REMEDY)
        return np.stack(frames)

    return files.read(path, decode, _REMEDY)


def video_frames(path: str | Path, size: tuple[int, int] | None = None, grey: bool = False) -> Iterator[np.ndarray]:
    """Yield the frames of a video one after the other, uint8 RGB (H, W_, 3) or, where ``grey``, luminance (H, W_).

    Args:
        path: the file; long videos are never held as a whole.
        size: width and height to which frames are scaled; as they are where None.
        grey: yield luminance.

    Raises:
        DnnvssError: the file is missing, unreadable, breaks off or holds no frame.
    """
    container = files.read(path, opened, _REMEDY)
    width, height = size or (None, None)
    with container:
        if not container.streams.video:
            raise DnnvssError("has no video stream", file=path, remedy=_REMEDY)
        container.streams.video[0].thread_type = "AUTO"
        count = 0
        try:
            for frame in container.decode(video=0):
                count += 1
                yield frame.to_ndarray(format="gray" if grey else "rgb24", width=width, height=height)
        except av.FFmpegError as error:
            raise DnnvssError(f"breaks off after {count} frames ({error})", file=path, remedy=_REMEDY) from error
        if not count:
            raise DnnvssError("holds no frame", file=path, remedy=_REMEDY)


def read_audio(path: str | Path, rate: int = SPEECH_RATE) -> np.ndarray:
    """Return the sound of a wav or video file, mono float32 (samples,) in [-1, 1] at ``rate`` samples a second.

    Raises:
        DnnvssError: the file is missing, unreadable or has no sound.
    """

    def decode(p: Path) -> np.ndarray:
        with opened(p) as container:
            if not container.streams.audio:
                raise DnnvssError("has no sound", file=p, remedy="Give a recording with an audio stream")
            resampler = av.AudioResampler(format="flt", layout="mono", rate=rate)
            blocks = [b for frame in container.decode(audio=0) for b in resampler.resample(frame)]
            blocks += resampler.resample(None)
        chunks = [b.to_ndarray().reshape(-1) for b in blocks]
        if not chunks or not sum(map(len, chunks)):
            raise DnnvssError("its sound is empty", file=p, remedy="Give a recording with an audio stream")
        return np.concatenate(chunks)

    return files.read(path, decode, _REMEDY)


def write_wav(path: str | Path, samples: np.ndarray, rate: int) -> Path:
    """Write mono float samples (n,) in [-1, 1] as 16-bit PCM and return the path; louder samples are clipped."""
    with files.replacing(path) as temporary:
        scipy.io.wavfile.write(temporary, rate, (np.clip(samples, -1, 1) * 32767).astype(np.int16))
    return Path(path)
