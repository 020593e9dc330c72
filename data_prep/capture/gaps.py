"""Missing stretches of coordinates, filled by resampling in the domain of the discrete cosine transform.

**Source**: Edge et al. 2004, section 4, name the method; the penalty is that of Garcia, "Robust smoothing of gridded
data in one and higher dimensions with missing values", Computational Statistics & Data Analysis 54, 2010, equation 9.
"""

from functools import lru_cache

import numpy as np
from scipy.fft import dct

from dnnvss.timing import fill_invalid

_SMOOTH = 30.0
"""Weight of the penalty: an oscillation of 15 frames is halved."""
_AROUND = 24
"""Known frames on either side of a gap that tell what is in it."""


def filled(tracks: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Tracks (F, C) whose unknown samples are those of the smooth course near the known ones.

    Over the N frames of a gap and around it, the course ``x`` with cosine coefficients ``c`` has the least
    ``sum over known (x - y)^2 + s sum_k w_k c_k^2``, ``w_k = (2 - 2 cos(pi k / N))^2``; it stands in the gap, known
    samples stay as they are. Beyond the first and the last known sample the value is held.

    Args:
        tracks: values; what is not known may be NaN.
        known: (F, C) bool.
    """
    out = np.array(tracks, dtype=float)
    for column in range(out.shape[1]):
        there = np.flatnonzero(known[:, column])
        if not len(there):
            continue
        first, last = int(there[0]), int(there[-1])
        line = fill_invalid(out[:, column], known[:, column])
        for start, stop in _runs(~known[:, column]):
            if start > first and stop - 1 < last:
                low, high = max(first, start - _AROUND), min(last + 1, stop + _AROUND)
                line[low:high] = _smoothest(line[low:high], known[low:high, column])
        out[:, column] = line
    return out


def _runs(mask: np.ndarray) -> list[tuple[int, int]]:
    """First and end of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _smoothest(values: np.ndarray, known: np.ndarray) -> np.ndarray:
    course = np.linalg.solve(
        np.diag(known.astype(float)) + _SMOOTH * _form(len(values)), known * values
    )
    return np.where(known, values, course)


@lru_cache(maxsize=256)
def _form(count: int) -> np.ndarray:
    """The quadratic form (N, N) of the penalty on N samples."""
    basis = dct(np.eye(count), axis=0, norm="ortho")
    weights = (2 - 2 * np.cos(np.pi * np.arange(count) / count)) ** 2
    return np.asarray(basis.T @ (weights[:, None] * basis))
