"""The frame rate that time stamps tell."""

from collections.abc import Collection
from pathlib import Path

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.formats.openface import Landmarks
from dnnvss.timing import FrameClock
from dnnvss.timing.rates import USUAL_RATES

_ROUNDED = 2e-3
"""Seconds by which the first and the last time stamp together may be rounded."""
_LATE = 1.5
"""Frames by which a time stamp may differ from a constant rate."""
_REMEDY = "Track a recording of a constant rate, or give the rate: landmarks.json (rate) or corpus.importer.rate"


def stamped(landmarks: Landmarks, file: Path) -> tuple[int, float] | None:
    """Frames and seconds from the first time stamp to the last; None where there are not two.

    Raises:
        DnnvssError: the time stamps do not rise.
    """
    if landmarks.times is None or len(at := np.flatnonzero(np.isfinite(landmarks.times))) < 2:
        return None
    first, last = landmarks.times[at[0]], landmarks.times[at[-1]]
    if not last > first:
        raise DnnvssError(f"its time stamps do not rise: {first:g} s at frame {at[0]}, {last:g} s at frame {at[-1]}",
                          file=file, remedy=_REMEDY)
    return int(at[-1] - at[0]), float(last - first)


def common_rate(spans: Collection[tuple[int, float]]) -> FrameClock | None:
    """The frame rate of files by their frames and seconds (see :func:`stamped`); None where there are none.

    Stamps are rounded (OpenFace's to milliseconds): what may be a rate that cameras have is taken for it.
    """
    if not spans:
        return None
    seconds = sum(s for _, s in spans)
    rate = sum(f for f, _ in spans) / seconds
    near = min(USUAL_RATES, key=lambda clock: abs(float(clock.rate) - rate))
    off = abs(float(near.rate) / rate - 1)
    return near if off <= _ROUNDED * len(spans) / seconds else FrameClock(round(rate, 3))


def check_times(landmarks: Landmarks, clock: FrameClock, file: Path) -> None:
    """Refuse time stamps that leave a constant rate by more than 1.5 frames.

    Raises:
        DnnvssError: they do; names the first such frame.
    """
    if landmarks.times is None:
        return
    known = np.flatnonzero(np.isfinite(landmarks.times))
    late = (landmarks.times[known] - landmarks.times[known[:1]]) * float(clock.rate) - (known - known[:1])
    if (far := np.abs(late) > _LATE).any():
        at = int(np.flatnonzero(far)[0])
        raise DnnvssError(f"frame {known[at]} comes {late[at]:.1f} frames late at {float(clock.rate):g} a second",
                          file=file, remedy=_REMEDY)
