"""Log-mel energies: the power of the sound in bands as wide as those of hearing."""

from dataclasses import dataclass

import numpy as np

from dnnvss.acoustics.analysis import RATE, Analysis
from dnnvss.acoustics.mel import mel_filters, power, transform_of
from dnnvss.errors import DnnvssError
from dnnvss.settings import check_settings, setting


@dataclass(frozen=True)
class LogMel(Analysis):
    """The power in mel bands.

    ``ln max(floor, sum_k M_bk |X_k|^2 / sum_n w_n^2)``: ``X`` is the Fourier transform of the N
    samples under a Hann window ``w``, ``M`` the triangles of :func:`mel_filters`. White noise of
    variance v has the expected power v in every band.

    **Source**: Davis and Mermelstein 1980 for the bands, without the cosine transform.

    Args:
        bands: how many (B).
        window: milliseconds of sound that a frame looks at.
        low, high: Hz, where the lowest band begins and the highest ends.
        floor: the least power; white noise of variance 1 has power 1 in every band.
        causal: whether the window ends with its frame.

    Raises:
        DnnvssError: a setting out of range, or bands narrower than the window can tell apart.
    """

    bands: int = setting(40, least=1, most=512, doc="mel bands")
    window: float = setting(25.0, least=2, most=500, doc="milliseconds of sound that a frame looks at")
    low: float = setting(60.0, least=0, below=RATE / 2, doc="Hz at which the lowest band begins")
    high: float = setting(7000.0, above=0, most=RATE / 2, doc="Hz at which the highest band ends")
    floor: float = setting(1e-7, above=0, below=1, doc="least power; white noise of variance 1 has 1")
    causal: bool = setting(False, doc="whether the window ends with its frame")

    name = "logmel"
    unit = "ln of power"
    spread = 2.0
    paper = "Davis and Mermelstein 1980, mel bands"

    def __post_init__(self) -> None:
        check_settings(self, "labels.logmel")
        if self.low >= self.high:
            raise DnnvssError(f"labels.logmel.low={self.low:g} is not below high={self.high:g}",
                              remedy="Give the lower of the two first")
        if not self._filters.any(axis=1).all():
            raise DnnvssError(f"labels.logmel.bands={self.bands}: a window of {self.window:g} ms "
                              "cannot tell bands apart that are so narrow",
                              remedy="Take fewer bands, or a longer window")

    @property
    def columns(self) -> tuple[str, ...]:
        """``mel01`` and so on."""
        return tuple(f"mel{band:02d}" for band in range(1, self.bands + 1))

    @property
    def meaning(self) -> tuple[str, str]:
        """The power in mel bands."""
        return "the power", (f"in mel bands from {self.low:g} to {self.high:g} Hz, {self.where} "
                             f"(log-mel {self.key})")

    @property
    def transform(self) -> int:
        """Points of the Fourier transform."""
        return transform_of(self.samples)

    @property
    def _filters(self) -> np.ndarray:
        return mel_filters(self.bands, self.low, self.high, self.transform)

    def rows(self, pieces: np.ndarray) -> np.ndarray:
        """Energies (n, B) of windows (n, N)."""
        spectrum = power(pieces, np.hanning(self.samples + 1)[:-1], self.transform)
        return np.log(np.maximum(spectrum @ self._filters.T, self.floor))
