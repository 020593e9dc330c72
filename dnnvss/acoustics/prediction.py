"""Linear prediction: the all-pole filter that leaves the least of a sound unexplained."""

from dataclasses import dataclass

import numpy as np

from dnnvss.acoustics.analysis import Analysis
from dnnvss.acoustics.mel import emphasised, transform_of
from dnnvss.settings import check_settings, setting

FLOOR = 1e-9
"""Power of the noise that is taken to lie under every sound, about that of the last bit of 16:
silence has a filter too, that of white noise."""


@dataclass(frozen=True)
class LinearPrediction(Analysis):
    """What analyses by linear prediction declare in common, and the filters that they work out.

    ``A(z) = 1 + a_1 z^-1 + ... + a_p z^-p`` such that ``sum_j a_j r_|i-j| = 0`` for i = 1 to p: the
    filter under which the window has the least energy left. ``r`` is the autocorrelation of the
    samples with high frequencies raised, under a Hamming window.

    **Source**: Makhoul 1975; Theobald 2007, section 4.1.

    Args:
        order: of the filter (p).
        window: milliseconds of sound that a frame looks at.
        emphasis: how far high frequencies are raised: ``x_t - emphasis x_(t-1)``.
        causal: whether the window ends with its frame.

    Raises:
        DnnvssError: a setting out of range.
    """

    order: int = setting(16, least=1, most=100, doc="coefficients")
    window: float = setting(40.0, least=8, most=500, doc="milliseconds of sound that a frame looks at")
    emphasis: float = setting(0.97, least=0, below=1, doc="how far high frequencies are raised")
    causal: bool = setting(False, doc="whether the window ends with its frame")

    paper = "Theobald 2007, section 4.1"

    def __post_init__(self) -> None:
        check_settings(self, f"labels.{self.name}")

    def filters(self, pieces: np.ndarray) -> np.ndarray:
        """The filters (n, p + 1), first coefficient 1, of windows (n, N)."""
        return levinson(autocorrelation(emphasised(pieces, self.emphasis), self.order))


@dataclass(frozen=True)
class Lpc(LinearPrediction):
    """Coefficients of linear prediction by the autocorrelation method (16 in Theobald 2007)."""

    name = "lpc"
    unit = "share of an earlier sample"
    spread = 0.5

    @property
    def columns(self) -> tuple[str, ...]:
        """``a01`` and so on."""
        return tuple(f"a{i:02d}" for i in range(1, self.order + 1))

    @property
    def meaning(self) -> tuple[str, str]:
        """Coefficients of linear prediction."""
        return "coefficients of linear prediction", f"{self.where} (lpc {self.key})"

    def rows(self, pieces: np.ndarray) -> np.ndarray:
        """Coefficients (n, p) of windows (n, N), without the leading 1."""
        return self.filters(pieces)[:, 1:]


def autocorrelation(pieces: np.ndarray, order: int) -> np.ndarray:
    """The autocorrelation (n, p + 1) of windows (n, N) under a Hamming window, a sample's worth.

    ``r_k = sum_t w_t x_t w_(t+k) x_(t+k) / sum_t w_t^2``, and :data:`FLOOR` more at k = 0.
    """
    window = np.hamming(pieces.shape[1])
    spectrum = np.abs(np.fft.rfft(pieces * window, transform_of(2 * pieces.shape[1]), axis=1)) ** 2
    found = np.fft.irfft(spectrum, axis=1)[:, : order + 1] / (window**2).sum()
    found[:, 0] += FLOOR
    return found


def levinson(correlation: np.ndarray) -> np.ndarray:
    """The filters (n, p + 1), first coefficient 1, of autocorrelations (n, p + 1).

    **Source**: the recursion of Levinson and Durbin, in the form of Makhoul 1975, equation 38.
    """
    order = correlation.shape[1] - 1
    filters = np.zeros_like(correlation)
    filters[:, 0], left = 1, correlation[:, 0].copy()
    for m in range(1, order + 1):
        reflection = -(correlation[:, m:0:-1] * filters[:, :m]).sum(axis=1) / left
        filters[:, 1 : m + 1] += reflection[:, None] * filters[:, m - 1 :: -1][:, :m].copy()
        left *= 1 - reflection**2
    return filters
