"""Drop-frame time code: counts 29.97 frames a second to 30 and yet keeps to the clock, by numbers that it leaves out.

At the beginning of each minute but every tenth the numbers 0 and 1 are passed over (0 to 3 of 59.94 frames a second);
no frame is.

**Source**: SMPTE ST 12-1, Time and Control Code, drop frame.
"""

from fractions import Fraction

import numpy as np


def has_drop_frame(rate: Fraction) -> bool:
    """Whether frames of a rate may be counted so: 29.97, 59.94 and 119.88."""
    base = round(rate)
    return base % 30 == 0 and rate * 1001 == base * 1000


def left_out(labels: np.ndarray, base: int) -> np.ndarray:
    """Which of some numbers (F,) are never given to a frame.

    Args:
        labels: as if none were passed over: ``base`` to the second since midnight.
        base: frames a second that are counted, a multiple of 30.
    """
    minutes, within = np.divmod(labels, 60 * base)
    return (minutes % 10 > 0) & (within < base // 15)


def frames_of(labels: np.ndarray, base: int) -> np.ndarray:
    """The frames (F,) since midnight to which numbers (F,) belong; arguments as those of :func:`left_out`."""
    minutes = labels // (60 * base)
    return labels - base // 15 * (minutes - minutes // 10)


def labels_of(frames: np.ndarray, base: int) -> np.ndarray:
    """The numbers (F,) of frames (F,) since midnight: what :func:`frames_of` takes."""
    skipped = base // 15
    tens, rest = np.divmod(frames, 600 * base - 9 * skipped)
    minutes = np.maximum((rest - skipped) // (60 * base - skipped), 0)
    return frames + skipped * (9 * tens + minutes)
