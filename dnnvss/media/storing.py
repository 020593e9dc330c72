"""The sound of a recording of hours, written as a plain file block by block."""

import wave
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.media.containers import opened
from dnnvss.media.hearing import Mix, Moments, as_many, laid_blocks

_REMEDY = "Give a recording with an audio stream"
_SILENT = 1e-4
"""Largest sample of a track that holds nothing."""
_HEADER = 44  # bytes before the samples of a wav file


def store_sound(path: str | Path, out: str | Path, rate: int, zero: float | None = None) -> float:
    """Write the sound of a recording as mono 16-bit wav at ``rate`` and return its seconds.

    Tracks, channels and gaps are heard as :func:`dnnvss.media.hearing.mono` hears them, in two passes and
    in the memory of one block.

    Args:
        path: the recording.
        out: the wav file.
        rate: samples a second.
        zero: the time stamp at which the file begins; that of the first sample where None.

    Raises:
        DnnvssError: the recording is missing, unreadable or has no sound.
    """
    path = Path(path)
    track, channels, mix = files.read(path, lambda p: _heard(p, rate), _REMEDY)

    def write(p: Path) -> int:
        with opened(p) as container, files.replacing(out) as temporary, wave.open(str(temporary), "wb") as file:
            file.setnchannels(1)
            file.setsampwidth(2)
            file.setframerate(rate)
            count = 0
            for block in _placed(laid_blocks(container, track, rate), mix, channels, rate, zero):
                file.writeframesraw((np.clip(block, -1, 1) * 32767).astype("<i2").tobytes())
                count += len(block)
            return count

    return int(files.read(path, write, _REMEDY)) / rate


def _heard(path: Path, rate: int) -> tuple[int, int, Mix]:
    """The first track that holds any sound, its channels and how they are mixed."""
    with opened(path) as container:
        tracks = len(container.streams.audio)
    if not tracks:
        raise DnnvssError("has no sound", file=path, remedy=_REMEDY)
    for track in range(tracks):
        moments, loudest = Moments(1), 0.0
        with opened(path) as container:
            for _, block in laid_blocks(container, track, rate):
                if len(block) > len(moments.sums):
                    moments = moments.widened(len(block))
                moments.add(as_many(block, len(moments.sums)))
                loudest = max(loudest, float(np.abs(block).max(initial=0.0)))
        if loudest > _SILENT:
            return track, len(moments.sums), moments.mix()
    raise DnnvssError("its sound is silence", file=path, remedy="Give a recording with speech")


def _placed(blocks: Iterator[tuple[float, np.ndarray]], mix: Mix, channels: int, rate: int,
            zero: float | None) -> Iterator[np.ndarray]:
    """Yield the blocks mixed, from the time stamp ``zero`` on."""
    lacking: int | None = None
    for start, block in blocks:
        if lacking is None:
            lacking = 0 if zero is None else round((start - zero) * rate)
            if lacking > 0:
                yield np.zeros(lacking, np.float32)
        mono = mix.of(as_many(block, channels))
        cut = min(max(-lacking, 0), len(mono))
        lacking += cut
        yield mono[cut:]


def stored(path: str | Path) -> np.ndarray:
    """The samples (n,) int16 of a wav file that :func:`store_sound` wrote, mapped and not read."""
    samples: np.ndarray = files.read(path, lambda p: np.memmap(p, "<i2", "r", offset=_HEADER),
                                     "Delete the folder .stages of the corpus and prepare it again")
    return samples


def stretch(path: str | Path, rate: int, start: float, end: float) -> np.ndarray:
    """Samples (n,) float32 from ``start`` to ``end`` seconds of a wav file that :func:`store_sound` wrote."""
    samples = stored(path)[max(round(start * rate), 0) : max(round(end * rate), 0)]
    return np.asarray(samples, np.float32) / 32767
