"""Analyses of a sound in windows, a row for each frame of a clock: centred, or causal."""

import hashlib
from abc import ABC, abstractmethod
from dataclasses import astuple
from math import gcd
from typing import Any, ClassVar

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.media import LOUDEST, SPEECH_RATE, Sound
from dnnvss.timing import FrameClock

RATE = SPEECH_RATE
"""Samples a second at which sounds are analysed; others are resampled."""
_CHUNK = 4096  # windows worked out at once


class Analysis(ABC):
    """A feature of a window of sound.

    A subclass is a frozen dataclass of settings with the fields ``window`` (milliseconds) and, last,
    ``causal``; it says what its columns are and works them out of windows cut at :data:`RATE`.
    """

    name: ClassVar[str]
    """How feature sources and settings call it."""
    version: ClassVar[int] = 1
    """Raised when its numbers change."""
    unit: ClassVar[str]
    """What its numbers count or measure."""
    paper: ClassVar[str]
    """Where it is defined."""
    spread: ClassVar[float]
    """About how much its numbers deviate in speech."""
    window: float
    causal: bool

    @property
    @abstractmethod
    def columns(self) -> tuple[str, ...]:
        """The names of its C columns."""

    @property
    @abstractmethod
    def meaning(self) -> tuple[str, str]:
        """What the columns are, and how they are made."""

    @abstractmethod
    def rows(self, pieces: np.ndarray) -> np.ndarray:
        """The feature (n, C) of windows of sound (n, N) float64; each row is its window's alone."""

    @property
    def samples(self) -> int:
        """Samples (N) of the window."""
        return round(self.window * RATE / 1000)

    @property
    def where(self) -> str:
        """How the window lies to its frame, in words."""
        return f"{self.window:g} ms of sound " + (
            "up to its end" if self.causal else "around its centre")

    @property
    def key(self) -> str:
        """A hash of everything that the numbers depend on."""
        fields = astuple(self)  # type: ignore[call-overload]
        parts = (self.version, RATE, *(fields if self.causal else fields[:-1]))
        return hashlib.sha256(repr(parts).encode()).hexdigest()[:8]


def analyse(sound: Sound, analysis: Analysis, clock: FrameClock, first: int, count: int,
            dtype: type = np.float32) -> np.ndarray:
    """The feature (count, C) of frames ``first`` to ``first + count - 1`` of a clock.

    A centred window lies around the frame's centre; where it would reach beyond the sound, the
    nearest one that does not takes its place. A causal window ends where its frame ends: nothing
    behind that edge is looked at, and around the sound there is silence. A sound shorter than the
    window is followed by silence.

    Args:
        sound: its time 0 is the edge of frame 0.
        analysis: of each window.
        clock: of the frames.
        first, count: which frames.
        dtype: of the numbers; they are worked out in float64.

    Raises:
        DnnvssError: samples that are no finite numbers in about [-1, 1].
    """
    samples = resampled(sound)
    starts = window_starts(analysis, clock, first + np.arange(count))
    if not analysis.causal:
        starts = np.clip(starts, 0, max(len(samples) - analysis.samples, 0))
    out: np.ndarray = np.empty((count, len(analysis.columns)), dtype)
    for low in range(0, count, _CHUNK):
        part = slice(low, low + _CHUNK)
        out[part] = analysis.rows(cut(samples, starts[part], analysis.samples))
    return out


def window_starts(analysis: Analysis, clock: FrameClock, frames: np.ndarray) -> np.ndarray:
    """The first sample (n,) int64 of each frame's window; it may lie before the sound."""
    size = analysis.samples
    if analysis.causal:
        return np.floor(clock.times(frames + 1) * RATE + 0.5).astype(np.int64) - size
    return np.floor(clock.times(frames + 0.5) * RATE - size / 2 + 0.5).astype(np.int64)


def cut(samples: np.ndarray, starts: np.ndarray, size: int) -> np.ndarray:
    """Windows (n, size) float64 of samples; beyond them there is silence."""
    places = starts[:, None] + np.arange(size)
    if not len(samples):
        return np.zeros(places.shape)
    pieces = samples.take(places, mode="clip").astype(np.float64)
    if (starts < 0).any() or (starts + size > len(samples)).any():
        pieces[(places < 0) | (places >= len(samples))] = 0
    return pieces


def resampled(sound: Sound) -> np.ndarray:
    """The samples (n,) at :data:`RATE`, of the sound's own type.

    Raises:
        DnnvssError: samples that are no finite numbers in about [-1, 1], or no rate.
    """
    samples: Any = np.asarray(sound.samples)
    check_samples(samples)
    if sound.rate == RATE:
        return samples
    if sound.rate < 1:
        raise DnnvssError(f"a sound of {sound.rate} samples a second",
                          remedy="Give the rate at which it was recorded")
    from scipy.signal import resample_poly  # here: slower to load than all else that features need

    shared = gcd(sound.rate, RATE)
    return resample_poly(samples, RATE // shared, sound.rate // shared)


def check_samples(samples: np.ndarray) -> None:
    """Refuse what is no sound.

    Raises:
        DnnvssError: samples that are not one row of finite numbers, or far beyond [-1, 1].
    """
    if samples.ndim != 1 or samples.dtype.kind != "f":
        raise DnnvssError(f"a sound of shape {samples.shape} and type {samples.dtype}",
                          remedy="Give one channel of numbers in [-1, 1]")
    low, high = (float(f(samples)) for f in (np.min, np.max)) if len(samples) else (0.0, 0.0)
    if not np.isfinite([low, high]).all():  # one that is no number makes both so
        raise DnnvssError("the sound holds samples that are no finite numbers",
                          remedy="Write the recording anew")
    if max(-low, high) > LOUDEST:
        raise DnnvssError(f"the sound reaches {max(-low, high):g}, and 1 is full scale",
                          remedy="Divide the samples by that of full scale, e.g. 32768")
