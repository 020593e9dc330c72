"""Stretches of recordings joined to one sound: each laid where its wave fits that before it, then faded over.

**Source.** Overlap and add at the lag of greatest similarity: W. Verhelst, M. Roelands, "An overlap-add
technique based on waveform similarity (WSOLA)", ICASSP 1993; here over joins alone, nothing is
stretched.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

FADE, LAG = 0.008, 0.006
"""Seconds on each side of a join that are faded over, and by which a stretch is moved to fit, at most."""


@dataclass(frozen=True)
class Stretch:
    """A part of a recording.

    Args:
        samples: the whole recording (n,).
        start, stop: samples that the part begins with and ends before.
    """

    samples: np.ndarray
    start: int
    stop: int

    def cut(self, first: int, last: int) -> np.ndarray:
        """Samples (last - first,) of the recording; silence where it has none."""
        low, high = np.clip([first, last], 0, len(self.samples))
        inside = self.samples[low:high]
        return np.pad(inside, (low - first if low > first else 0, last - high if last > high else 0))[: last - first]


def joined(stretches: Sequence[Stretch], rate: int) -> np.ndarray:
    """The sound (sum of their lengths,) float32 of stretches one after the other.

    Args:
        stretches: each shorter ones are faded over no more than half of their length.
        rate: samples a second.
    """
    lengths = [s.stop - s.start for s in stretches]
    edges = np.concatenate([[0], np.cumsum(lengths)]).astype(int)
    out, lag = np.zeros(edges[-1]), 0
    for k, stretch in enumerate(stretches):
        before = _half(lengths[k - 1 : k + 1], rate) if k else 0
        after = _half(lengths[k : k + 2], rate) if k < len(stretches) - 1 else 0
        if k:
            lag = _best_lag(stretches[k - 1], lag, stretch, before, rate)
        made = stretch.cut(stretch.start + lag - before, stretch.stop + lag + after).astype(float)
        made[: 2 * before] *= _rise(before)
        if after:
            made[-2 * after :] *= _rise(after)[::-1]
        out[edges[k] - before : edges[k + 1] + after] += made
    return out.astype(np.float32)


def _half(lengths: Sequence[int], rate: int) -> int:
    """Samples on each side of the join of two stretches that are faded over."""
    return min(round(FADE * rate), min(lengths) // 2)


def _rise(half: int) -> np.ndarray:
    """Weights (2 half,) from 0 to 1; with their mirror image they add up to 1."""
    return 0.5 - 0.5 * np.cos(np.pi * (np.arange(2 * half) + 0.5) / max(2 * half, 1))


def _best_lag(left: Stretch, lag: int, right: Stretch, half: int, rate: int) -> int:
    """By how many samples the right stretch is moved so that its wave is most like that of the left one at the join."""
    most = round(LAG * rate)
    one = left.cut(left.stop + lag - half, left.stop + lag + half).astype(float)
    two = right.cut(right.start - most - half, right.start + most + half).astype(float)
    if half == 0 or not one.any():
        return 0
    windows = np.lib.stride_tricks.sliding_window_view(two, 2 * half)
    alike = windows @ one / np.sqrt((windows**2).sum(axis=1) + 1e-9 * len(one))
    return int(alike.argmax()) - most
