"""Mel-frequency cepstral coefficients: the shape of the spectrum as hearing has it, uncorrelated."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from dnnvss.acoustics.analysis import RATE, Analysis
from dnnvss.acoustics.mel import emphasised, mel_filters, power, transform_of
from dnnvss.errors import DnnvssError
from dnnvss.settings import check_settings, setting

_LEAST = 512  # points of the transform: a window of 10 ms still tells the lowest bands apart


@dataclass(frozen=True)
class Mfcc(Analysis):
    """The cosine transform of log-mel energies.

    ``c_i = s_i sum_b ln max(floor, E_b) cos(pi i (b + 1/2) / B)`` with ``s_0 = sqrt(1 / B)`` and
    ``s_i = sqrt(2 / B)``: the orthonormal DCT-II. ``E`` are the powers in mel bands of the samples
    with high frequencies raised, under a Hamming window. The 13 coefficients of Theobald 2007 begin
    with c0, the 12 of Cosker 2004 with c1 (``count=12 zeroth=false``).

    **Source**: Davis and Mermelstein 1980; Theobald 2007, section 4.1; Cosker 2004, section 3.

    Args:
        count: how many coefficients (C).
        zeroth: whether they begin with c0, which is loudness, or with c1.
        bands: mel bands (B).
        window: milliseconds of sound that a frame looks at.
        low, high: Hz, where the lowest band begins and the highest ends.
        emphasis: how far high frequencies are raised: ``x_t - emphasis x_(t-1)``.
        floor: the least power in a band.
        causal: whether the window ends with its frame.

    Raises:
        DnnvssError: a setting out of range, or more coefficients than bands.
    """

    count: int = setting(13, least=1, most=512, doc="coefficients")
    zeroth: bool = setting(True, doc="whether they begin with c0, the loudness")
    bands: int = setting(26, least=1, most=512, doc="mel bands")
    window: float = setting(40.0, least=2, most=500, doc="milliseconds of sound that a frame looks at")
    low: float = setting(0.0, least=0, below=RATE / 2, doc="Hz at which the lowest band begins")
    high: float = setting(8000.0, above=0, most=RATE / 2, doc="Hz at which the highest band ends")
    emphasis: float = setting(0.97, least=0, below=1, doc="how far high frequencies are raised")
    floor: float = setting(1e-9, above=0, below=1, doc="least power; white noise of variance 1 has 1")
    causal: bool = setting(False, doc="whether the window ends with its frame")

    name = "mfcc"
    unit = "ln of power, orthonormal DCT-II"
    spread = 3.0
    paper = "Theobald 2007, section 4.1; Cosker 2004, section 3"

    def __post_init__(self) -> None:
        check_settings(self, "labels.mfcc")
        if self.low >= self.high:
            raise DnnvssError(f"labels.mfcc.low={self.low:g} is not below high={self.high:g}",
                              remedy="Give the lower of the two first")
        if self.count + (not self.zeroth) > self.bands:
            raise DnnvssError(f"labels.mfcc.count={self.count}: {self.bands} mel bands have not so "
                              "many coefficients", remedy="Take fewer, or more bands")
        if not self._filters.any(axis=1).all():
            raise DnnvssError(f"labels.mfcc.bands={self.bands}: a window of {self.window:g} ms "
                              "cannot tell bands apart that are so narrow",
                              remedy="Take fewer bands, or a longer window")

    @property
    def columns(self) -> tuple[str, ...]:
        """``c00`` or ``c01`` and so on."""
        first = int(not self.zeroth)
        return tuple(f"c{i:02d}" for i in range(first, first + self.count))

    @property
    def meaning(self) -> tuple[str, str]:
        """Mel-frequency cepstral coefficients."""
        return "mel-frequency cepstral coefficients", f"{self.where} (mfcc {self.key})"

    @property
    def transform(self) -> int:
        """Points of the Fourier transform."""
        return transform_of(self.samples, _LEAST)

    @property
    def _filters(self) -> np.ndarray:
        return mel_filters(self.bands, self.low, self.high, self.transform)

    def rows(self, pieces: np.ndarray) -> np.ndarray:
        """Coefficients (n, C) of windows (n, N)."""
        window = np.hamming(self.samples)
        spectrum = power(emphasised(pieces, self.emphasis), window, self.transform)
        energies = np.log(np.maximum(spectrum @ self._filters.T, self.floor))
        first = int(not self.zeroth)
        return energies @ cosines(self.bands)[first : first + self.count].T


@lru_cache
def cosines(size: int) -> np.ndarray:
    """The orthonormal DCT-II (size, size): row i is ``s_i cos(pi i (b + 1/2) / size)``."""
    order, place = np.arange(size)[:, None], np.arange(size) + 0.5
    scale = np.where(order == 0, 1.0, 2.0) / size
    return np.sqrt(scale) * np.cos(np.pi * order * place / size)
