"""Another road to a smooth trajectory: a cubic smoothing spline near the data."""

import numpy as np
from scipy.linalg import solveh_banded

from dnnvss.errors import DnnvssError
from dnnvss.timing import FrameClock

_FEWEST = 5


def smoothing_spline(
    trajectory: np.ndarray, clock: FrameClock | None = None, cutoff: float | None = None
) -> np.ndarray:
    """Return the trajectory (T, D) smoothed by a cubic smoothing spline, in the dtype of the input.

    The spline s minimises ``sum (x - s)^2 + lambda * integral of s''^2``, which damps a wave of angular frequency w (a
    frame) by ``1 / (1 + lambda w^4)``. With a cutoff f in hertz, ``lambda = (rate / 2 pi f)^4``: movement at f is
    halved. Without one, lambda is chosen for each coefficient by generalised cross-validation, which assumes noise
    that is white from frame to frame. Fewer than five frames come back as they are.

    Args:
        trajectory: (T, D).
        clock: needed with a cutoff.
        cutoff: hertz.

    Raises:
        DnnvssError: a cutoff without a clock, or one that is not positive.

    **Source**: Theobald et al. 2007, section 5; Theobald et al. 2003, section 5.
    """
    x = np.asarray(trajectory)
    if len(x) < _FEWEST:
        return x.copy()
    if cutoff is not None:
        if clock is None or cutoff <= 0:
            raise DnnvssError(f"a smoothing spline cannot have a cutoff of {cutoff} Hz without a clock or below zero",
                              remedy="Give clock=FrameClock(100) and a cutoff of, say, 8")
        return _smoothed(x.astype(float), float(clock.rate / (2 * np.pi * cutoff)) ** 4).astype(x.dtype)
    from scipy.interpolate import make_smoothing_spline  # slow to import

    frames = np.arange(len(x), dtype=float)
    columns = [make_smoothing_spline(frames, column)(frames) for column in x.astype(float).T]
    return np.stack(columns, axis=1).astype(x.dtype)


def _smoothed(x: np.ndarray, penalty: float) -> np.ndarray:
    """Return the smoothing spline of (T, D) at its knots: ``x - penalty Q g`` with ``(R + penalty Q'Q) g = Q'x``.

    Q takes second differences, and R is the Gram matrix of the second derivative's hat functions. Linear in T.

    **Source**: Reinsch, Smoothing by spline functions (1967); Green and Silverman, Nonparametric regression and
        generalized linear models (1994), section 2.3.
    """
    bands = np.empty((3, len(x) - 2))
    bands[2] = 2 / 3 + 6 * penalty
    bands[1] = 1 / 6 - 4 * penalty
    bands[0] = penalty
    bend = solveh_banded(bands, np.diff(x, n=2, axis=0))
    return x - penalty * np.diff(np.pad(bend, ((2, 2), (0, 0))), n=2, axis=0)
