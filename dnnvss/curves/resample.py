"""From one frame rate to another, centre to centre, without drift."""

import numpy as np
from scipy.linalg import lapack

from dnnvss.curves.passages import spans
from dnnvss.errors import DnnvssError
from dnnvss.timing import FrameClock


def resample(trajectory: np.ndarray, source: FrameClock, target: FrameClock, count: int | None = None) -> np.ndarray:
    """Return the trajectory at another frame rate, shape (T2, ...), in the dtype of the input (float).

    Frame ``i`` holds the value at its centre ``(i + 0.5) / rate``. Between centres runs a cubic spline (not-a-knot)
    through all of them; before the first and behind the last centre the end value is held. Every target time is
    computed from its own frame number and the two exact rates, so nothing adds up: there is no drift however long the
    trajectory is.

    Going to a lower rate takes samples of the spline and filters nothing: movement above half the target rate folds
        back.
    Visible speech has next to no power above 8 Hz, so from 25 frames a second upwards this costs nothing; smooth
    noisier curves first (:func:`dnnvss.curves.splines.smoothing_spline`).

    Args:
        trajectory: (T, ...) at the source rate, T at least 1.
        source: the clock of the input.
        target: the clock of the output.
        count: number of output frames; by default those whose edges span the same time, ``round(T * target / source)``.

    Raises:
        DnnvssError: the trajectory is empty or not finite.

    **Source**: Thangthai et al. 2016, section 4.4 (30 to 100 frames a second); Theobald et al. 2007, section 4 (cubic
        splines).
    """
    trajectory = np.asarray(trajectory)
    if trajectory.ndim < 1 or len(trajectory) < 1 or not np.isfinite(trajectory).all():
        raise DnnvssError(f"a trajectory of shape {trajectory.shape} is empty or not finite, so it cannot be resampled",
                          remedy="Give at least one frame of finite values")
    ratio = source.rate / target.rate
    if count is None:
        count = max(1, int(np.floor(len(trajectory) / ratio + 0.5)))
    dtype = trajectory.dtype if np.issubdtype(trajectory.dtype, np.floating) else np.dtype(float)
    if len(trajectory) == 1 or (ratio == 1 and count == len(trajectory)):
        return np.repeat(trajectory, count, axis=0).astype(dtype) if len(trajectory) == 1 else trajectory.astype(dtype)
    # (2 i + 1) / 2 * ratio - 1 / 2, in source frames; the product of integers is exact up to 2^53.
    position = (2 * np.arange(count) + 1) * ratio.numerator / (2 * ratio.denominator) - 0.5
    return _splined(trajectory, np.clip(position, 0, len(trajectory) - 1), dtype)


def _splined(trajectory: np.ndarray, position: np.ndarray, dtype: np.dtype) -> np.ndarray:
    """The cubic spline through a trajectory (T, ...) at positions (T2,) in its frames, in order; passage by passage.

    What a frame does to the spline dies out as ``.27^n`` over n frames.
    """
    frames = len(trajectory)
    out = np.empty((len(position), *trajectory.shape[1:]), dtype)
    for first, last, around in spans(frames):
        own = slice(*np.searchsorted(position, (first, last if last < frames else np.inf)))
        part = trajectory[around].astype(float)
        out[own] = _spline(part.reshape(len(part), -1), position[own] - around.start).reshape(-1, *part.shape[1:])
    return out


def _spline(knots: np.ndarray, position: np.ndarray) -> np.ndarray:
    """The cubic spline (not-a-knot) through knots (T, D), one a frame and two at least, at positions (T2,).

    What :class:`scipy.interpolate.CubicSpline` gives; its package takes a tenth of a second to import.
    """
    rise = np.diff(knots, axis=0)
    slope = _slopes(rise)
    left = np.clip(position.astype(int), 0, len(rise) - 1)
    t = (position - left)[:, None]
    start, rise = slope[left], rise[left]
    bend = start + slope[left + 1] - 2 * rise
    return knots[left] + t * (start + t * (rise - start - bend + t * bend))


def _slopes(rise: np.ndarray) -> np.ndarray:
    """The slopes (T, D) of the spline at its knots, from what each frame rises (T - 1, D) to the next."""
    count = len(rise) + 1
    if count == 2:
        return np.repeat(rise, 2, axis=0)
    if count == 3:  # a parabola
        bend = (rise[1] - rise[0]) / 2
        return np.stack([rise[0] - bend, rise[0] + bend, rise[1] + bend])
    right = np.empty((count, rise.shape[1]))
    right[1:-1] = 3 * (rise[:-1] + rise[1:])
    right[0], right[-1] = (5 * rise[0] + rise[1]) / 2, (5 * rise[-1] + rise[-2]) / 2
    below, middle = np.ones(count - 1), np.full(count, 4.0)
    middle[[0, -1]], below[-1] = 1.0, 2.0
    slopes: np.ndarray = lapack.dgtsv(below, middle, below[::-1].copy(), right)[3]
    return slopes
