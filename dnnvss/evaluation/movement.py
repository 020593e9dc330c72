"""How a trajectory moves: lag, smoothness, stillness, and distance when time may be warped."""

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.timing import FrameClock

MAX_LAG = 0.2
"""Seconds; longer lags are not looked for."""
CUTOFF = 8.0
"""Hertz; visible speech has next to no power above it."""
_FEWEST = 8


def lag(reference: np.ndarray, predicted: np.ndarray, clock: FrameClock, longest: float = MAX_LAG) -> float:
    """Return by how many seconds a prediction (T,) is late (negative: early), NaN where nothing moves or nothing
    matches.

    The lag at which the normalised cross-correlation of the two velocities (first differences) is greatest, over lags
    up to ``longest`` that leave half of the frames or more to compare (fewer match by chance), refined by a parabola
    through the peak and its neighbours. Where the greatest value is not positive there is no match.
    """
    r, p = np.diff(reference), np.diff(predicted)
    reach = min(clock.edge(longest), len(r) // 2, len(r) - 2)
    if reach < 1 or r.std() == 0 or p.std() == 0:
        return float("nan")
    values = np.array([_overlap_correlation(r, p, k) for k in range(-reach, reach + 1)])
    peak = int(np.nanargmax(values))
    if not values[peak] > 0:
        return float("nan")
    shift = float(peak - reach)
    if 0 < peak < len(values) - 1:
        before, at, after = values[peak - 1 : peak + 2]
        bend = before - 2 * at + after
        shift += 0.5 * (before - after) / bend if bend < 0 else 0.0
    return shift / float(clock.rate)


def _overlap_correlation(r: np.ndarray, p: np.ndarray, k: int) -> float:
    """Return the cosine of ``r[t]`` and ``p[t + k]`` over the frames that both have."""
    a, b = (r[: len(r) - k], p[k:]) if k >= 0 else (r[-k:], p[: len(p) + k])
    size = np.sqrt((a**2).sum() * (b**2).sum())
    return float((a * b).sum() / size) if size > 0 else -1.0


def jerk(trajectory: np.ndarray, clock: FrameClock) -> float:
    """Return the root mean square third derivative of (T, D), in units per second cubed; NaN below four frames.

    Third differences times the cube of the rate, squared, averaged over frames and coefficients.
    """
    if len(trajectory) < 4:
        return float("nan")
    third = np.diff(np.asarray(trajectory, float), n=3, axis=0) * float(clock.rate) ** 3
    return float(np.sqrt((third**2).mean()))


def high_power(trajectory: np.ndarray, clock: FrameClock, cutoff: float = CUTOFF) -> float:
    """Return the share of a trajectory's power (T, D) above ``cutoff`` hertz; NaN where nothing moves or T is below 8.

    The periodogram of each coefficient less its mean under a Hann window, summed over coefficients: power above the
        cutoff
    over power above zero.
    """
    x = np.asarray(trajectory, float)
    if len(x) < _FEWEST:
        return float("nan")
    power = (np.abs(np.fft.rfft((x - x.mean(axis=0)) * np.hanning(len(x))[:, None], axis=0)) ** 2).sum(axis=1)
    frequency = np.fft.rfftfreq(len(x), 1 / float(clock.rate))
    total = power[frequency > 0].sum()
    return float(power[frequency > cutoff].sum() / total) if total > 1e-20 * (x**2).sum() else float("nan")


def speed(points: np.ndarray, clock: FrameClock, mask: np.ndarray) -> float:
    """Return the root mean square speed over the frame steps inside a mask, in units a second; NaN where there are
    none.

    Args:
        points: (T, P, 2) in pixels, or (T, D); the speed of a step is that of its mean square point or coefficient.
        clock: of the points.
        mask: (T,) bool; a step counts where both of its frames do.
    """
    step = np.diff(np.asarray(points, float), axis=0) * float(clock.rate)
    own = (step**2).sum(axis=-1).mean(axis=-1) if step.ndim == 3 else (step**2).mean(axis=-1)
    kept = mask[1:] & mask[:-1]
    return float(np.sqrt(own[kept].mean())) if kept.any() else float("nan")


def dtw(reference: np.ndarray, predicted: np.ndarray, band: int) -> float:
    """Return the mean distance along the best warping path between two trajectories (T, D), NaN where one is empty.

    The distance of two frames is Euclidean. The path runs from the first frames to the last ones by steps of one frame
    in either or both, at most ``band`` frames from the diagonal; it minimises the sum of distances, which is divided
    by the number of pairs on it.

    Raises:
        DnnvssError: trajectories of different size.

    **Source**: Sakoe and Chiba, Dynamic programming algorithm optimization for spoken word recognition (1978).
    """
    r, p = np.asarray(reference, float), np.asarray(predicted, float)
    if r.shape != p.shape:
        raise DnnvssError(f"reference {r.shape} and prediction {p.shape} differ in size", remedy="Give the same frames")
    frames = len(r)
    if not frames:
        return float("nan")
    # own[i, j], and cost[j] and pairs[j] in row i, belong to the cell (i, i + j - band)
    width = 2 * band + 1
    own = np.full((frames, width), np.inf)
    for j in range(max(band - frames, 0), min(band + frames, width)):
        first, end = max(band - j, 0), min(frames + band - j, frames)
        own[first:end, j] = np.sqrt(((r[first:end] - p[first + j - band : end + j - band]) ** 2).sum(axis=-1))
    cost, pairs = [np.inf] * (width + 1), [0] * (width + 1)
    cost[band] = 0.0
    for row in own.tolist():
        left, behind = np.inf, 0
        for j, distance in enumerate(row):  # steps along the row depend on one another
            best, count = (cost[j], pairs[j]) if cost[j] <= cost[j + 1] else (cost[j + 1], pairs[j + 1])
            if left < best:
                best, count = left, behind
            left, behind = best + distance, count + 1
            cost[j], pairs[j] = left, behind
    return float(cost[band] / pairs[band])


def landmark_error(reference: np.ndarray, predicted: np.ndarray) -> np.ndarray:
    """Return the mean distance of the points of each frame (T,) for shapes (T, P, 2), in their unit."""
    return np.sqrt(((np.asarray(predicted, float) - np.asarray(reference, float)) ** 2).sum(axis=-1)).mean(axis=-1)
