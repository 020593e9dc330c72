"""The frame rates that cameras have, and which of them time stamps tell."""

from bisect import bisect_left
from collections.abc import Collection, Sequence
from fractions import Fraction

import numpy as np

from dnnvss.timing.clock import FrameClock

USUAL_RATES = tuple(FrameClock(rate) for rate in (
    "10", "12", "12.5", "15", "20", "23.976", "24", "25", "29.97", "30", "48", "50", "59.94", "60", "90", "100",
    "119.88", "120", "200", "240"))
"""Rates that cameras have."""

LATE, DRIFT = 1.5, 0.6
"""Frames by which a time stamp, and the last one, may differ from those of a constant rate."""

_LONGEST = 600.0
"""Seconds beyond which a gap between frames is a mistake of the file (:mod:`dnnvss.media.hearing`)."""

_SAME, _NEAR = 5e-5, 0.01  # shares by which a rate may differ from a usual one: written otherwise, jittered


def is_steady(times: np.ndarray, rate: Fraction) -> bool:
    """Whether frames at times (F,) in seconds keep to a constant rate; clocks of ticks and jitter count as such."""
    late = (times - times[0]) * float(rate) - np.arange(len(times))
    return bool(np.abs(late).max() <= LATE and abs(late[-1]) <= DRIFT)


def rate_of(times: np.ndarray, told: Collection[Fraction] = ()) -> Fraction:
    """The frame rate of frames at times (F,) in seconds that rise.

    A constant rate is one that the file tells or that cameras have, where the stamps keep to it: the average of stamps
    that are rounded to ticks differs from clip to clip. Of frames at a variable rate it is the usual rate nearest to
    the middle of their spacings.

    Args:
        times: of the frames.
        told: rates that the file tells, the likeliest first.
    """
    usual = [clock.rate for clock in USUAL_RATES]
    if len(times) < 2:
        return next(iter(told), Fraction(25))
    average = (len(times) - 1) / (times[-1] - times[0])
    near = sorted((r for r in usual if abs(float(r) / average - 1) < _NEAR), key=lambda r: abs(float(r) - average))
    same = [r for t in told for r in usual if abs(float(t / r) - 1) < _SAME]
    plain = Fraction(average).limit_denominator(1001)
    steady = next((r for r in (*same, *near, *told, plain) if is_steady(times, r)), None)
    middle = 1 / float(np.median(np.diff(times)))
    return steady or min(usual, key=lambda r: abs(np.log(float(r) / middle)))


def even_frames(times: np.ndarray, rate: Fraction) -> tuple[np.ndarray, np.ndarray]:
    """Which frame is shown at each tick of a constant rate, and whether it was taken then.

    Frames that keep to the rate are taken one by one; else each tick shows the frame that is seen in its middle.

    Args:
        times: (F,) of the frames in seconds, rising.
        rate: frames a second wanted.

    Returns:
        The frames (N,), and (N,) bool: False within gaps, where the nearest frame is far.
    """
    if is_steady(times, rate):
        return np.arange(len(times)), np.ones(len(times), bool)
    step = float(np.median(np.diff(times)))
    count = max(1, int((times[-1] - times[0] + step) * float(rate) + 0.5))
    wanted = times[0] + np.arange(count) / float(rate)
    index = np.maximum(np.searchsorted(times, wanted + 0.5 / float(rate) - 1e-6, "right") - 1, 0)
    return index, np.abs(times[index] - wanted) <= 1.5 * max(1 / float(rate), step)


def rising(times: Sequence[float | None], rate: Fraction) -> np.ndarray:
    """Time stamps (F,) in seconds from 0.

    Stamps that are absent or stand out of their order lie between their neighbours; where the first one or more than
    a tenth are amiss (recordings that were joined count from 0 again), frames are at the rate. A gap of ten minutes is
    none, as in the sound: the second of two recordings follows the first.
    """
    known = np.array([np.nan if t is None else t for t in times], float)
    if not (np.isfinite(known).all() and (np.diff(known) > 0).all()):
        known = _mended(known, rate)
    steps = np.diff(known)
    if (steps >= _LONGEST).any():
        known = np.cumsum([0.0, *np.where(steps < _LONGEST, steps, 1 / float(rate))])
    return known - known[:1]


def _mended(known: np.ndarray, rate: Fraction) -> np.ndarray:
    """Stamps (F,) that rise, for some that do not or are NaN."""
    every, kept = np.arange(len(known)), _in_order(known)
    if not len(kept) or kept[0] or 10 * len(kept) < 9 * len(known):
        return every / float(rate)
    found = np.interp(every, kept, known[kept])
    found[kept[-1] :] = known[kept[-1]] + (every[kept[-1] :] - kept[-1]) / float(rate)
    return found


def _in_order(known: np.ndarray) -> np.ndarray:
    """Numbers of the most stamps (F,) that rise, NaN none of them: the longest increasing subsequence."""
    ends, last, before = list[float](), list[int](), dict[int, int]()
    for k in np.flatnonzero(np.isfinite(known)).tolist():
        at = bisect_left(ends, known[k])
        before[k] = last[at - 1] if at else -1
        ends[at : at + 1], last[at : at + 1] = [known[k]], [k]
    chain = list[int]()
    k = last[-1] if last else -1
    while k >= 0:
        chain.append(k)
        k = before[k]
    return np.array(chain[::-1], int)
