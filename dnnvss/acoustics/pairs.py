"""Line spectral frequencies: the filter of linear prediction as an ordered row of angles."""

from dataclasses import dataclass

import numpy as np

from dnnvss.acoustics.prediction import LinearPrediction
from dnnvss.settings import setting


@dataclass(frozen=True)
class Lsf(LinearPrediction):
    """Line spectral frequencies, in rising order between 0 and pi.

    The angles at which ``P(z) = A(z) + z^-(p+1) A(1/z)`` and ``Q(z) = A(z) - z^-(p+1) A(1/z)`` are
    zero, those at 0 and pi left out; ``A`` is that of :class:`~dnnvss.acoustics.Lpc`. There are as
    many as the order of the filter.

    **Source**: Itakura 1975; Theobald 2007, section 4.1 (15 of them).
    """

    order: int = setting(15, least=1, most=40, doc="frequencies")

    name = "lsf"
    unit = "radians a sample"
    spread = 0.1

    @property
    def columns(self) -> tuple[str, ...]:
        """``l01`` and so on."""
        return tuple(f"l{i:02d}" for i in range(1, self.order + 1))

    @property
    def meaning(self) -> tuple[str, str]:
        """Line spectral frequencies."""
        return "line spectral frequencies", f"{self.where} (lsf {self.key})"

    def rows(self, pieces: np.ndarray) -> np.ndarray:
        """Frequencies (n, p) of windows (n, N)."""
        return line_spectrum(self.filters(pieces))


def line_spectrum(filters: np.ndarray) -> np.ndarray:
    """The line spectral frequencies (n, p), radians, of stable filters (n, p + 1).

    Without their roots at 1 and -1, P and Q are symmetric of even degree, so that they are
    polynomials in ``cos w``: series of Chebyshev polynomials, whose roots are eigenvalues.
    """
    longer = np.pad(filters, ((0, 0), (0, 1)))
    sums, differences = longer + longer[:, ::-1], longer - longer[:, ::-1]
    if filters.shape[1] % 2:  # even order: P has the root -1, Q the root 1
        parts = _without(sums, -1), _without(differences, 1)
    else:  # odd order: Q has both
        parts = sums, _without(_without(differences, 1), -1)
    cosines = np.concatenate([_roots(_chebyshev(part)) for part in parts], axis=1)
    return np.arccos(np.clip(-np.sort(-cosines, axis=1), -1, 1))


def _without(polynomials: np.ndarray, root: int) -> np.ndarray:
    """Polynomials (n, m + 1) in falling powers, divided by ``z - root``, which is 1 or -1."""
    signs = np.where(np.arange(polynomials.shape[1]) % 2, root, 1)
    return (np.cumsum(polynomials * signs, axis=1) * signs)[:, :-1]


def _chebyshev(symmetric: np.ndarray) -> np.ndarray:
    """Chebyshev series (n, m + 1), lowest first, of symmetric polynomials (n, 2 m + 1) on the circle."""
    middle = symmetric.shape[1] // 2
    series = 2 * symmetric[:, middle:]
    series[:, 0] /= 2
    return series


def _roots(series: np.ndarray) -> np.ndarray:
    """The real roots (n, m) of Chebyshev series (n, m + 1): eigenvalues of their colleague matrices."""
    size = series.shape[1] - 1
    matrix = np.zeros((len(series), size, size))
    if size == 0:
        return np.zeros((len(series), 0))
    if size == 1:
        return -series[:, :1] / series[:, 1:]
    beside = np.full(size - 1, 0.5)
    beside[0] = np.sqrt(0.5)
    index = np.arange(size - 1)
    matrix[:, index, index + 1] = matrix[:, index + 1, index] = beside
    scale = np.where(np.arange(size), 0.5, np.sqrt(0.5))  # in the symmetric form T_0 counts sqrt(2)
    matrix[:, :, -1] -= series[:, :-1] / series[:, -1:] * scale
    return np.linalg.eigvals(matrix).real
