"""Formants: the resonances of the vocal tract, from linear prediction of the low part of the spectrum."""

from dataclasses import dataclass

import numpy as np

from dnnvss.acoustics.analysis import RATE, Analysis
from dnnvss.acoustics.mel import emphasised, power, transform_of
from dnnvss.acoustics.prediction import FLOOR, levinson
from dnnvss.settings import check_settings, setting

_EDGE = 50.0  # Hz from 0 and from the top within which a root is no formant


@dataclass(frozen=True)
class Formants(Analysis):
    """The lowest resonances, in Hz.

    A filter of linear prediction is fitted to the spectrum up to ``top`` alone, and the angles of
    its complex roots, lowest first, are the formants. Where it has fewer, the others are those of a
    tube of 17.5 cm that is closed at one end: ``500 (2 i - 1)`` Hz; they mean nothing in silence.

    **Source**: Makhoul 1975, section V (selective linear prediction); Theobald 2007, section 4.1
    (three of them).

    Args:
        count: how many (C).
        top: Hz up to which the spectrum is looked at; 5000 for men, 5500 for women.
        order: of the filter, two for each resonance below ``top``.
        window: milliseconds of sound that a frame looks at.
        emphasis: how far high frequencies are raised: ``x_t - emphasis x_(t-1)``.
        causal: whether the window ends with its frame.

    Raises:
        DnnvssError: a setting out of range.
    """

    count: int = setting(3, least=1, most=8, doc="formants")
    top: float = setting(5000.0, least=1000, most=RATE / 2, doc="Hz up to which they are looked for")
    order: int = setting(10, least=2, most=40, doc="of the filter, two for each resonance below top")
    window: float = setting(40.0, least=8, most=500, doc="milliseconds of sound that a frame looks at")
    emphasis: float = setting(0.98, least=0, below=1, doc="how far high frequencies are raised")
    causal: bool = setting(False, doc="whether the window ends with its frame")

    name = "formants"
    unit = "Hz"
    spread = 300.0
    paper = "Theobald 2007, section 4.1"

    def __post_init__(self) -> None:
        check_settings(self, "labels.formants")

    @property
    def columns(self) -> tuple[str, ...]:
        """``f1`` and so on."""
        return tuple(f"f{i}" for i in range(1, self.count + 1))

    @property
    def meaning(self) -> tuple[str, str]:
        """Formants."""
        return "formant frequencies", f"{self.where} (formants {self.key})"

    def rows(self, pieces: np.ndarray) -> np.ndarray:
        """Formants (n, C) of windows (n, N)."""
        transform = transform_of(2 * self.samples)
        window = np.hamming(self.samples)
        spectrum = power(emphasised(pieces, self.emphasis), window, transform)
        last = round(self.top / RATE * transform)
        filters = levinson(_band_correlation(spectrum[:, : last + 1], self.order))
        return self._lowest(_angles(filters) / np.pi * last * RATE / transform)

    def _lowest(self, hertz: np.ndarray) -> np.ndarray:
        """The lowest frequencies (n, C) of all (n, p), of which those at the edges do not count."""
        real = (hertz > _EDGE) & (hertz < self.top - _EDGE)
        found = np.sort(np.where(real, hertz, np.inf), axis=1)
        found = np.pad(found, ((0, 0), (0, self.count)), constant_values=np.inf)[:, : self.count]
        return np.where(np.isinf(found), 500.0 * (2 * np.arange(self.count) + 1), found)


def _band_correlation(spectrum: np.ndarray, order: int) -> np.ndarray:
    """The autocorrelation (n, p + 1) of sounds of which a spectrum (n, K) is all there is."""
    last = spectrum.shape[1] - 1
    weights = np.full(last + 1, 1.0 / last)
    weights[[0, -1]] /= 2
    turns = np.cos(np.pi * np.arange(order + 1) * np.arange(last + 1)[:, None] / last)
    found = (spectrum * weights) @ turns
    found[:, 0] += FLOOR
    return found


def _angles(filters: np.ndarray) -> np.ndarray:
    """The angles (n, p) of the roots of filters (n, p + 1); 0 for those that are real or a mirror."""
    order = filters.shape[1] - 1
    matrix = np.zeros((len(filters), order, order))
    matrix[:, 0] = -filters[:, 1:]
    matrix[:, np.arange(1, order), np.arange(order - 1)] = 1
    roots = np.linalg.eigvals(matrix)
    return np.where(roots.imag > 1e-9, np.angle(roots), 0.0)
