"""Voicing: how far a sound repeats itself at the rate of a voice."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from dnnvss.acoustics.analysis import RATE, Analysis
from dnnvss.acoustics.mel import transform_of
from dnnvss.acoustics.prediction import FLOOR
from dnnvss.errors import DnnvssError
from dnnvss.settings import check_settings, setting


@dataclass(frozen=True)
class Voicing(Analysis):
    """How periodic a window is, 0 to 1.

    The highest ``r_k / r_0`` over the lags k of a voice, where ``r`` is the autocorrelation of the
    samples less their mean under a Hann window, divided by that of the window itself: 1 for what
    repeats itself exactly, little for noise, 0 in silence.

    **Source**: Boersma 1993, equations 9 and 22, without the choice of a pitch over time.

    Args:
        low, high: Hz, the lowest and the highest voice.
        window: milliseconds of sound that a frame looks at, two periods of the lowest voice at least.
        causal: whether the window ends with its frame.

    Raises:
        DnnvssError: a setting out of range, or a window too short for the lowest voice.
    """

    low: float = setting(70.0, least=20, most=RATE / 4, doc="Hz of the lowest voice")
    high: float = setting(400.0, least=20, most=RATE / 4, doc="Hz of the highest voice")
    window: float = setting(40.0, least=2, most=500, doc="milliseconds of sound that a frame looks at")
    causal: bool = setting(False, doc="whether the window ends with its frame")

    name = "voicing"
    unit = "share"
    spread = 0.3
    paper = "Boersma 1993"

    def __post_init__(self) -> None:
        check_settings(self, "labels.voicing")
        if self.low >= self.high:
            raise DnnvssError(f"labels.voicing.low={self.low:g} is not below high={self.high:g}",
                              remedy="Give the lower of the two first")
        if self.window * self.low < 2000:
            raise DnnvssError(f"labels.voicing.window={self.window:g}: a voice of {self.low:g} Hz "
                              "has not two periods in it",
                              remedy=f"Take {2000 / self.low:.0f} ms or more, or a higher voice")

    @property
    def columns(self) -> tuple[str, ...]:
        """One."""
        return ("voicing",)

    @property
    def meaning(self) -> tuple[str, str]:
        """Periodicity."""
        return "how periodic the sound is", (f"from {self.low:g} to {self.high:g} Hz, {self.where} "
                                             f"(voicing {self.key})")

    def rows(self, pieces: np.ndarray) -> np.ndarray:
        """Voicing (n, 1) of windows (n, N)."""
        window, own = _window(self.samples)
        level = pieces - (pieces * window).sum(axis=1, keepdims=True) / window.sum()
        found = _correlation(level * window) / (window**2).sum()
        lags = slice(int(RATE / self.high), int(RATE / self.low) + 1)
        ratio = found[:, lags] / own[lags] / (found[:, :1] + FLOOR)
        return np.clip(ratio.max(axis=1, keepdims=True), 0, 1)


@lru_cache
def _window(samples: int) -> tuple[np.ndarray, np.ndarray]:
    """The window (N,), and its autocorrelation (N,) from 1 at lag 0."""
    window = np.hanning(samples + 1)[:-1]
    own = _correlation(window[None])[0]
    return window, own / own[0]


def _correlation(pieces: np.ndarray) -> np.ndarray:
    """The autocorrelation (n, N) of rows (n, N), silence around them."""
    size = pieces.shape[1]
    spectrum = np.abs(np.fft.rfft(pieces, transform_of(2 * size), axis=1)) ** 2
    return np.fft.irfft(spectrum, axis=1)[:, :size]
