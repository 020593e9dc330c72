"""Video files with sound: H.264 and AAC in MP4, every frame at its exact time."""

from collections.abc import Iterable, Iterator
from contextlib import closing
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.media.ahead import ahead
from dnnvss.media.reading import SOUND_RATE, SPEECH_RATE
from dnnvss.shortages import MEMORY
from dnnvss.timing import FrameClock

_AAC_RATES = (8000, 11025, 12000, 16000, 22050, 24000, 32000, 44100, 48000)
_AAC_BLOCK = 1024
_RATES = Fraction(1, 100), 1000
"""Frames a second of a video, least and most."""
_PRESET, _FINER = "veryfast", 2
"""How hard x264 looks for a smaller file, and how many steps finer than asked for it then has to quantise to come as
near to what was drawn as its preset ``fast``: 40.29 and 40.27 dB on drawn pictures of GRID, 41.60 and 41.61 on recorded
ones, with files of .94 and 1.10 the size, in half the time."""
_FORGOTTEN = 1 << 20
"""Samples after which the memory of sound is given back that lies in a file."""
_BT601 = "colorprim=smpte170m:transfer=smpte170m:colormatrix=smpte170m"
"""The colour space that the conversion from RGB uses, written into the file so that players do not have to guess."""
_B_FRAMES = "b-adapt=0"
"""Groups of frames of one length: to look for better ones takes a tenth of the time, and makes no smaller files."""
_COLOURS = np.array([[-37.797, -74.203, 112.0, 128 * 255], [112.0, -93.786, -18.214, 128 * 255], [0, 0, 0, 0]],
                    np.float32) / 255
"""Blue and red difference of ITU-R BT.601 in studio range, from R, G, B and 1; three rows take OpenCV a tenth of the
time of two."""


def write_video(
    path: str | Path,
    frames: Iterable[np.ndarray],
    rate: Fraction | int | float | str,
    audio: np.ndarray | None = None,
    audio_rate: int = SPEECH_RATE,
    quality: int = 18,
    pixel: Fraction = Fraction(1),
) -> Path:
    """Write frames, with sound where given, as MP4 and return the path.

    Frame ``i`` is shown at exactly ``i / rate`` seconds (the file counts in ticks of ``1 / rate``), so that no rate
    drifts. Picture and sound start at time zero; the encoder's silent lead-in is skipped by the file's edit list. The
    index stands at the front, so that browsers play while they load. The file is whole or absent. Frames are made by a
    thread of their own while those before them are encoded.

    Args:
        path: the file, ``.mp4``.
        frames: pictures, uint8 RGB (H, W_, 3), all of one size; an odd side is lengthened by a pixel.
        rate: frames a second, as :class:`FrameClock` takes it (``29.97`` means 30000/1001).
        audio: mono samples (n,) in [-1, 1], or None for a silent file.
        audio_rate: samples a second.
        quality: smaller is better and larger: constant rate factor of x264 at its preset ``fast``.
        pixel: width of a pixel over its height.

    Raises:
        DnnvssError: no frame, frames of different sizes, or a disk that cannot take the file.
    """
    path = Path(path)
    with closing(ahead(frames)) as source:
        return _written(path, source, rate, audio, audio_rate, quality, pixel)


def _written(path: Path, source: Iterator[np.ndarray], rate: Fraction | int | float | str, audio: np.ndarray | None,
             audio_rate: int, quality: int, pixel: Fraction) -> Path:
    first = next(source, None)
    if first is None:
        raise DnnvssError("there is no frame to write", file=path, remedy="Give an utterance that lasts a frame")
    clock = FrameClock(rate)
    if not _RATES[0] <= clock.rate <= _RATES[1]:
        raise DnnvssError(f"a video has {_RATES[0]} to {_RATES[1]} frames a second, not {clock}", file=path,
                          remedy="Give another rate")
    with files.replacing(path) as temporary:
        container = av.open(str(temporary), "w", format="mp4", options={"movflags": "faststart"})
        try:
            picture = video_stream(container, first.shape, clock.rate, quality, pixel)
            sound = SoundTrack(container, audio, audio_rate) if audio is not None and len(audio) else None
            _write(container, picture, sound, _same_size(path, first, source), clock)
            container.close()
        except av.error.ExternalError as error:  # of frames that are ours: what an encoder lacks is memory
            _abandon(container)
            raise ShortageError(f"the system is short of what the work needs: the encoder gave up ({error})",
                                file=path, remedy=MEMORY) from error
        except BaseException:
            _abandon(container)
            raise
    return path


def _write(
    container: Any, picture: Any, sound: "SoundTrack | None", frames: Iterator[np.ndarray], clock: FrameClock
) -> None:
    """Encode pictures and sound side by side, so that neither waits in memory for the other."""
    for index, image in enumerate(frames):
        frame = video_frame(image)
        frame.pts, frame.time_base = index, 1 / clock.rate
        container.mux(picture.encode(frame))
        if sound is not None:
            sound.write_until(clock.seconds(index + 1))
    container.mux(picture.encode(None))
    if sound is not None:
        sound.finish()


def _abandon(container: Any) -> None:
    """Close a container whose writing has failed; the first error is the one to report."""
    try:
        container.close()
    except (OSError, ValueError, av.FFmpegError):
        return


def video_stream(container: Any, shape: tuple[int, ...], rate: Fraction, quality: int, pixel: Fraction) -> Any:
    """A new H.264 stream of a container, whose clock counts in ticks of ``1 / rate``."""
    height, width = shape[:2]
    options = {"crf": str(max(quality - _FINER, 0)), "preset": _PRESET, "x264-params": f"{_BT601}:{_B_FRAMES}"}
    stream = container.add_stream("libx264", rate=rate, options=options)
    stream.width, stream.height, stream.pix_fmt = width + width % 2, height + height % 2, "yuv420p"
    stream.codec_context.time_base = 1 / rate
    stream.time_base = 1 / rate
    stream.codec_context.sample_aspect_ratio = pixel
    return stream


def video_frame(image: np.ndarray) -> av.VideoFrame:
    """A picture, uint8 RGB (H, W_, 3), as the encoder takes it; an odd side is lengthened by a pixel.

    A colour of four pixels is that of their mean. OpenCV's conversion and PyAV's take the colour of one of them and
    three times as long, in this order.
    """
    image = even_sides(np.ascontiguousarray(image))
    height, width = image.shape[:2]
    halved = cv2.resize(image, (width // 2, height // 2), interpolation=cv2.INTER_AREA)
    colours = cv2.transform(halved, _COLOURS)
    frame = av.VideoFrame(width, height, "yuv420p")
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2YUV_I420)[:height]
    for plane, values in zip(frame.planes, (grey, colours[..., 0], colours[..., 1]), strict=True):
        rows = np.frombuffer(memoryview(plane), np.uint8).reshape(plane.height, plane.line_size)
        rows[:, : plane.width] = values
    return frame


class SoundTrack:
    """Mono samples on their way into a container's AAC stream."""

    def __init__(self, container: Any, samples: np.ndarray, rate: int) -> None:
        samples = np.asarray(samples, dtype=np.float32).reshape(-1)
        self.rate = rate if rate in _AAC_RATES else SOUND_RATE
        self.samples = samples if self.rate == rate else _resampled(samples, rate, self.rate)
        self.container, self.done, self.forgotten = container, 0, 0
        self.stream = container.add_stream("aac", rate=self.rate, layout="mono")
        self.stream.bit_rate = 128_000 if self.rate >= 32000 else 64_000

    def write_until(self, seconds: float) -> None:
        """Encode the whole blocks that begin before a time."""
        while self.done < min(seconds * self.rate, len(self.samples)):
            block = np.clip(self.samples[None, self.done:self.done + _AAC_BLOCK], -1, 1)
            frame = av.AudioFrame.from_ndarray(np.ascontiguousarray(block), format="fltp", layout="mono")
            frame.sample_rate, frame.pts, frame.time_base = self.rate, self.done, Fraction(1, self.rate)
            self.container.mux(self.stream.encode(frame))
            self.done += block.shape[1]
            if self.done - self.forgotten >= _FORGOTTEN:
                files.forget(self.samples[self.forgotten : self.done])
                self.forgotten = self.done

    def finish(self) -> None:
        """Encode what is left."""
        self.write_until(float("inf"))
        self.container.mux(self.stream.encode(None))


def _resampled(samples: np.ndarray, source: int, target: int) -> np.ndarray:
    resampler = av.AudioResampler(format="flt", layout="mono", rate=target)
    frame = av.AudioFrame.from_ndarray(np.clip(samples[None], -1, 1), format="flt", layout="mono")
    frame.sample_rate = source
    blocks = [*resampler.resample(frame), *resampler.resample(None)]
    return np.concatenate([b.to_ndarray().reshape(-1) for b in blocks])


def even_sides(image: np.ndarray) -> np.ndarray:
    """A picture (H, W_, 3) whose odd sides are a pixel longer."""
    height, width = image.shape[:2]
    if height % 2 == 0 and width % 2 == 0:
        return image
    return np.pad(image, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")


def _same_size(path: Path, first: np.ndarray, rest: Iterator[np.ndarray]) -> Iterator[np.ndarray]:
    yield first
    for index, image in enumerate(rest, start=1):
        if image.shape != first.shape:
            raise DnnvssError(f"frame {index} has shape {image.shape} and the first has {first.shape}", file=path,
                              remedy="Render all frames at one size")
        yield image
