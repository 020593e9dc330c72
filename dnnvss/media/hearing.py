"""The sound of a recording, every block at its time, mono."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import av
import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.media.containers import opened
from dnnvss.media.sound import RATES

_JITTER = 0.02
"""Seconds by which the time stamp of a block may differ from the end of the one before: clocks of milliseconds."""
_LONGEST = 600.0
"""Seconds beyond which a gap is a mistake of the file, and no pause in it."""
_OFFSET = 1e-3
"""Share of full scale from which a constant offset is taken out."""
_SILENT = 1e-4
"""Largest sample of a channel that holds nothing."""
_CANCELLED = 0.5
"""Share of the loudest channel's power below which a mix of the channels is worse than that channel alone."""


def mono(path: Path, tracks: int, rate: int) -> tuple[np.ndarray, float]:
    """The sound (samples,) float32 at ``rate`` of the first track that holds any, and its first time stamp in seconds.

    Gaps in it are filled with silence, so that what follows stays in its place. Channels are mixed; those that hold
    nothing do not count, and where they cancel each other (a lead with swapped wires), the loudest stands alone. A
    constant offset, as cheap sound cards add, is taken out.

    Raises:
        DnnvssError: a rate that no sound has, or samples that are no finite numbers.
    """
    first = np.zeros(0, np.float32), 0.0
    for track in range(tracks):
        with opened(path) as container:
            _check_rate(container, track, path)
            laid = deque(laid_blocks(container, track, rate))
        start = laid[0][0] if laid else 0.0
        sound = _mixed_blocks(laid)
        if np.abs(sound).max(initial=0.0) > _SILENT:
            return sound, start
        first = first if track else (sound, start)
    return first


def mixed(channels: np.ndarray) -> np.ndarray:
    """One channel (n,) of several (C, n), each without its offset."""
    heard = Moments(len(channels))
    heard.add(channels)
    return heard.mix().of(channels)


@dataclass(frozen=True)
class Mix:
    """One channel of several: their weights (C,), and what is taken from each of them before (C,)."""

    weights: np.ndarray
    offsets: np.ndarray

    def of(self, channels: np.ndarray) -> np.ndarray:
        """The channel (n,) float32 of channels (C, n)."""
        return np.asarray(self.weights @ (channels - self.offsets[:, None]), np.float32)


class Moments:
    """What is to be known of channels before they are mixed, gathered block by block.

    Args:
        channels: how many.
    """

    def __init__(self, channels: int) -> None:
        self.count, self.sums = 0, np.zeros(channels)
        self.products = np.zeros((channels, channels))

    def add(self, block: np.ndarray) -> None:
        """Count a block (C, n)."""
        exact = block.astype(np.float64)
        self.count += block.shape[1]
        self.sums += exact.sum(axis=1)
        self.products += exact @ exact.T

    def widened(self, channels: int) -> "Moments":
        """The same, as if there had been so many channels, the last one repeated."""
        made, at = Moments(channels), np.minimum(np.arange(channels), len(self.sums) - 1)
        made.count, made.sums, made.products = self.count, self.sums[at], self.products[np.ix_(at, at)]
        return made

    def mix(self) -> Mix:
        """How the channels are mixed; those that hold nothing do not count."""
        count = max(self.count, 1)
        means = self.sums / count
        offsets = np.where(np.abs(means) > _OFFSET, means, 0)
        crossed = np.outer(offsets, means)
        powers = self.products / count - crossed - crossed.T + np.outer(offsets, offsets)
        own = np.diag(powers)
        heard = own > _SILENT**2
        weights = np.asarray(heard if heard.any() else np.ones(len(own)), float)
        weights /= weights.sum()
        if heard.any() and weights @ powers @ weights < _CANCELLED**2 * own.max():
            weights = np.eye(len(own))[own.argmax()]
        return Mix(weights.astype(np.float32), offsets.astype(np.float32))


def _mixed_blocks(laid: deque[tuple[float, np.ndarray]]) -> np.ndarray:
    """One channel (n,) of the blocks of a track, which are used up: an hour is never in memory three times."""
    most = max((len(block) for _, block in laid), default=1)
    heard, count, at = Moments(most), 0, 0
    for _, block in laid:
        heard.add(as_many(block, most))
        count += block.shape[1]
    mix, sound = heard.mix(), np.empty(count, np.float32)
    while laid:
        _, block = laid.popleft()
        sound[at : at + block.shape[1]] = mix.of(as_many(block, most))
        at += block.shape[1]
    return sound


def _check_rate(container: Any, track: int, path: Path) -> None:
    """Refuse a track of a rate that no sound has: a few kilobytes of it would be hours."""
    rate = container.streams.audio[track].rate
    if rate and not RATES[0] <= rate <= RATES[1]:
        raise DnnvssError(f"says that it has {rate} samples a second", file=path,
                          remedy=f"Write the rate that it was recorded at, {RATES[0]} to {RATES[1]}")


def as_many(block: np.ndarray, channels: int) -> np.ndarray:
    """A block (C, n) with so many channels: its last one is repeated."""
    lacking = channels - len(block)
    return np.pad(block, ((0, lacking), (0, 0)), mode="edge") if lacking else block


def laid_blocks(container: Any, track: int, rate: int) -> Iterator[tuple[float, np.ndarray]]:
    """Yield the blocks (C, n) float32 of a track one behind the other, gaps filled, each with the first time stamp.

    Raises:
        DnnvssError: samples that are no finite numbers.
    """
    for start, block in _blocks(container, track, rate):
        if not np.isfinite(block).all():
            raise DnnvssError("holds samples that are no finite numbers", file=container.name,
                              remedy="Write the recording anew")
        yield start, block


def _blocks(container: Any, track: int, rate: int) -> Iterator[tuple[float, np.ndarray]]:
    line: _Line | None = None
    before = int(container.format.name == "aac")  # blocks of no sound with which AAC begins, as other containers tell
    for frame in islice(container.decode(audio=track), before, None):
        line = line or _Line(rate, frame.time or 0.0)
        yield from ((line.start, block) for block in line.add(frame))
    if line is not None:
        yield from ((line.start, block) for block in line.rest())


class _Line:
    """Blocks of sound laid on a line of time."""

    def __init__(self, rate: int, start: float) -> None:
        self.rate, self.start = rate, start
        self.seconds, self.setup, self.count = 0.0, tuple[Any, ...](), 0
        self.resampler: Any = None

    def add(self, frame: Any) -> list[np.ndarray]:
        """What a block adds: itself, behind silence where its time stamp says that there is a gap."""
        missing = 0.0 if frame.time is None else frame.time - self.start - self.seconds
        setup = frame.format.name, frame.layout.name, frame.sample_rate
        made = list[np.ndarray]()
        if _JITTER < missing < _LONGEST or setup != self.setup:
            made += self.rest()
            self.resampler, self.setup = av.AudioResampler(format="flt", layout=frame.layout, rate=self.rate), setup
        if _JITTER < missing < _LONGEST:
            self.seconds += missing
            lacking = max(round(self.seconds * self.rate) - self.count, 0)
            self.count += lacking
            made.append(np.zeros((len(frame.layout.channels), lacking), np.float32))
        self.seconds += frame.samples / frame.sample_rate
        frame.pts = None  # blocks follow each other; gaps are filled above
        return made + self._resampled(frame)

    def rest(self) -> list[np.ndarray]:
        """What the resampler still holds."""
        made = self._resampled(None) if self.resampler is not None else []
        self.resampler = None
        return made

    def _resampled(self, frame: Any) -> list[np.ndarray]:
        """Resampled blocks (C, n); channels come one beside the other, for PyAV miscounts planes from eight on."""
        made = [block.to_ndarray().reshape(block.samples, -1).T for block in self.resampler.resample(frame)]
        self.count += sum(block.shape[1] for block in made)
        return made
