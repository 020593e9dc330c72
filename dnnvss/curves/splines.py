"""Other roads to a smooth trajectory: splines through and near the data, and averages of overlapping windows."""

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator, make_smoothing_spline
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
    frames = np.arange(len(x), dtype=float)
    columns = [make_smoothing_spline(frames, column)(frames) for column in x.astype(float).T]
    return np.stack(columns, axis=1).astype(x.dtype)


def _smoothed(x: np.ndarray, penalty: float) -> np.ndarray:
    """Return the smoothing spline of (T, D) at its knots: ``x - penalty Q g`` with ``(R + penalty Q'Q) g = Q'x``.

    Q takes second differences, and R is the Gram matrix of the second derivative's hat functions. Linear in T.

    **Source**: Reinsch, Smoothing by spline functions (1967); Green and Silverman, Nonparametric regression and
        generalized linear
    models (1994), section 2.3.
    """
    bands = np.empty((3, len(x) - 2))
    bands[2] = 2 / 3 + 6 * penalty
    bands[1] = 1 / 6 - 4 * penalty
    bands[0] = penalty
    bend = solveh_banded(bands, np.diff(x, n=2, axis=0))
    return x - penalty * np.diff(np.pad(bend, ((2, 2), (0, 0))), n=2, axis=0)


def interpolate(times: np.ndarray, values: np.ndarray, at: np.ndarray, kind: str = "hermite") -> np.ndarray:
    """Return a curve through points at other times, shape (N, D); before the first and behind the last the end is held.

    Args:
        times: (K,), increasing, in seconds or frames.
        values: (K, D).
        at: (N,), in the same unit.
        kind: ``hermite``, monotone between points, so that an opening never overshoots; or ``cubic``, with continuous
            curvature.

    Raises:
        DnnvssError: times that do not increase, or another kind.

    **Source**: Theobald et al. 2003, section 4 (Hermite, since natural splines overshoot); Theobald et al. 2007,
        section 4
    (cubic).
    """
    makers = {"hermite": PchipInterpolator, "cubic": CubicSpline}
    times, values = np.asarray(times, float), np.asarray(values, float)
    if kind not in makers:
        raise DnnvssError(f"no interpolation is named {kind!r}", remedy=f"Use one of {', '.join(makers)}")
    if len(times) != len(values) or not len(times) or (np.diff(times) <= 0).any():
        raise DnnvssError(f"{len(times)} times and {len(values)} values do not make a curve",
                          remedy="Give increasing times")
    if len(times) == 1:
        return np.repeat(values, len(at), axis=0)
    return makers[kind](times, values, axis=0)(np.clip(at, times[0], times[-1]))


def overlap_average(predictions: np.ndarray, starts: np.ndarray, frames: int, taper: str = "triangle") -> np.ndarray:
    """Return one trajectory (T, D) from predictions of overlapping windows: their weighted mean in each frame.

    Args:
        predictions: (N, K, D), N windows of K frames.
        starts: (N,), the frame at which each begins; parts outside 0..T do not count.
        frames: T.
        taper: ``triangle`` trusts the middle of a window most, ``flat`` all of it alike.

    Raises:
        DnnvssError: a frame that no window covers, or another taper.

    **Source**: Kim et al., A decision tree framework for spatiotemporal sequence prediction (2015), section 4, for the
        average;
    Edge et al. 2004, section 5.1.3, for the taper.
    """
    count, width, columns = predictions.shape
    shapes = {"flat": np.ones(width), "triangle": 1.0 + np.minimum(np.arange(width), np.arange(width)[::-1])}
    if taper not in shapes:
        raise DnnvssError(f"no taper is named {taper!r}", remedy=f"Use one of {', '.join(shapes)}")
    at = np.asarray(starts)[:, None] + np.arange(width)
    inside = (at >= 0) & (at < frames)
    weight = np.broadcast_to(shapes[taper], (count, width))[inside]
    total, norm = np.zeros((frames, columns)), np.zeros(frames)
    np.add.at(total, at[inside], weight[:, None] * predictions[inside])
    np.add.at(norm, at[inside], weight)
    if not norm.all():
        raise DnnvssError(f"frame {int(np.flatnonzero(norm == 0)[0])} is covered by no window",
                          remedy="Let the windows overlap and reach both ends")
    return total / norm[:, None]
