"""From one frame rate to another, centre to centre, without drift."""

import numpy as np
from scipy.interpolate import CubicSpline

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
        out[own] = CubicSpline(np.arange(len(part)), part, axis=0)(position[own] - around.start)
    return out
