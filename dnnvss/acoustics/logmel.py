"""Log-mel energies: the power of the sound in bands as wide as those of hearing, a row for each frame of a clock."""

import hashlib
from dataclasses import astuple, dataclass
from functools import cached_property, lru_cache
from math import gcd

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.media import SPEECH_RATE, Sound
from dnnvss.settings import check_settings, setting
from dnnvss.timing import FrameClock

RATE = SPEECH_RATE
"""Samples a second at which sounds are analysed; others are resampled."""
_VERSION = 1
"""Raised when the numbers change."""
_CHUNK = 4096  # frames worked out at once


@dataclass(frozen=True)
class LogMel:
    """What log-mel energies are made of.

    Args:
        bands: how many (B).
        window: milliseconds of sound that a frame looks at, around its centre.
        low, high: Hz, where the lowest band begins and the highest ends.
        floor: the least power; white noise of variance 1 has power 1 in every band.

    Raises:
        DnnvssError: a setting out of range, or bands narrower than the window can tell apart.
    """

    bands: int = setting(40, least=1, most=512, doc="mel bands")
    window: float = setting(25.0, least=2, most=500, doc="milliseconds of sound that a frame looks at")
    low: float = setting(60.0, least=0, below=RATE / 2, doc="Hz at which the lowest band begins")
    high: float = setting(7000.0, above=0, most=RATE / 2, doc="Hz at which the highest band ends")
    floor: float = setting(1e-7, above=0, below=1, doc="least power; white noise of variance 1 has 1")

    def __post_init__(self) -> None:
        check_settings(self, "labels.logmel")
        if self.low >= self.high:
            raise DnnvssError(f"labels.logmel.low={self.low:g} is not below high={self.high:g}",
                              remedy="Give the lower of the two first")
        if not mel_filters(self).any(axis=1).all():
            raise DnnvssError(f"labels.logmel.bands={self.bands}: a window of {self.window:g} ms cannot tell bands "
                              "apart that are so narrow", remedy="Take fewer bands, or a longer window")

    @cached_property
    def key(self) -> str:
        """A hash of everything that the numbers depend on."""
        return hashlib.sha256(repr((_VERSION, RATE, *astuple(self))).encode()).hexdigest()[:8]

    @property
    def samples(self) -> int:
        """Samples (N) of the window."""
        return round(self.window * RATE / 1000)

    @property
    def transform(self) -> int:
        """Points of the Fourier transform: the power of two that the window fits into."""
        return 1 << (self.samples - 1).bit_length()


def log_mel(sound: Sound, definition: LogMel, clock: FrameClock, first: int, count: int) -> np.ndarray:
    """The log-mel energies (count, B) float32 of frames ``first`` to ``first + count - 1`` of a clock.

    ``ln max(floor, sum_k M_bk |X_k|^2 / sum_n w_n^2)``: ``X`` is the Fourier transform of the N samples around the
    frame's centre under a Hann window ``w``, ``M`` the triangles of :func:`mel_filters`. White noise of variance v has
    the expected power v in every band. Where the window would reach beyond the sound, the nearest one that does not
    takes its place; a sound shorter than the window is followed by silence.

    **Source**: Davis and Mermelstein 1980 for the bands, without the cosine transform.

    Args:
        sound: its time 0 is the edge of frame 0.
        definition: bands and window.
        clock: of the frames.
        first, count: which frames.
    """
    samples, size = _resampled(sound), definition.samples
    samples = np.pad(samples, (0, max(0, size - len(samples))))
    centres = clock.times(first + np.arange(count) + 0.5) * RATE
    starts = np.clip(np.floor(centres - size / 2 + 0.5).astype(np.int64), 0, len(samples) - size)
    window, filters = np.hanning(size + 1)[:-1], mel_filters(definition)
    out = np.empty((count, definition.bands), np.float32)
    for low in range(0, count, _CHUNK):
        pieces = samples[starts[low : low + _CHUNK, None] + np.arange(size)] * window
        power = np.abs(np.fft.rfft(pieces, definition.transform, axis=1)) ** 2 / (window**2).sum()
        out[low : low + _CHUNK] = np.log(np.maximum(power @ filters.T, definition.floor))
    return out


@lru_cache
def mel_filters(definition: LogMel) -> np.ndarray:
    """Triangles (B, K) over the K points of the transform, equally spaced on the mel scale, each with the sum 1.

    The mel scale is ``2595 log10(1 + f / 700)``. A band between two points of the transform is zero.
    """
    low, high = (2595 * np.log10(1 + f / 700) for f in (definition.low, definition.high))
    edges = 700 * (10 ** (np.linspace(low, high, definition.bands + 2) / 2595) - 1)
    frequency = np.arange(definition.transform // 2 + 1) * RATE / definition.transform
    left, centre, right = edges[:-2, None], edges[1:-1, None], edges[2:, None]
    rising, falling = (frequency - left) / (centre - left), (right - frequency) / (right - centre)
    triangles = np.maximum(0, np.minimum(rising, falling))
    total = triangles.sum(axis=1, keepdims=True)
    return np.divide(triangles, total, out=np.zeros_like(triangles), where=total > 0)


def _resampled(sound: Sound) -> np.ndarray:
    """The samples (n,) float64 at :data:`RATE`."""
    samples = np.asarray(sound.samples, np.float64)
    if sound.rate == RATE:
        return samples
    from scipy.signal import resample_poly  # here: it takes longer to load than all else that features need

    shared = gcd(sound.rate, RATE)
    return resample_poly(samples, RATE // shared, sound.rate // shared)
