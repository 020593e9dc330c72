"""Time codes: hours, minutes, seconds and frames, as cutting rooms and capture programs count."""

import re
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.formats.drop_frame import frames_of, has_drop_frame, labels_of, left_out
from dnnvss.timing import FrameClock

_CODE = re.compile(r"(\d{1,2}):(\d{1,2}):(\d{1,2})([:;])(\d{1,3})", re.ASCII)
_REMEDY = "Give hours:minutes:seconds:frame, such as 01:00:00:00"


@dataclass(frozen=True)
class TimeCode:
    """The time code of a first frame.

    Frames are counted in the whole number nearest to the rate: 29.97 frames a second count to 30 and
    fall behind the clock, unless they are drop-frame, ``hours:minutes:seconds;frame``.

    Args:
        hours, minutes, seconds, frame: each within its place.
        drop: whether numbers are passed over so that the code keeps to the clock
            (:mod:`dnnvss.formats.drop_frame`).
    """

    hours: int = 0
    minutes: int = 0
    seconds: int = 0
    frame: int = 0
    drop: bool = False

    @classmethod
    def from_setting(cls, value: Any, where: str) -> "TimeCode":
        """The time code that a text gives.

        Raises:
            DnnvssError: it is none.
        """
        found = _CODE.fullmatch(str(value))
        parts = [int(found[i]) for i in (1, 2, 3, 5)] if found else [99] * 4
        if parts[0] > 23 or parts[1] > 59 or parts[2] > 59:
            raise DnnvssError(f"{where}={value!r} is no time code", remedy=_REMEDY)
        hours, minutes, seconds, frame = parts
        return cls(hours, minutes, seconds, frame, found is not None and found[4] == ";")

    def base(self, clock: FrameClock) -> int:
        """How many frames a second are counted.

        Raises:
            DnnvssError: the first frame's number is not below that, or the rate has no such drop-frame number.
        """
        base = max(1, round(float(clock.rate)))
        if self.frame >= base:
            raise DnnvssError(
                f"the time code begins with frame {self.frame}, and there are {base} a second",
                remedy=_REMEDY,
            )
        if self.drop and not has_drop_frame(clock.rate):
            raise DnnvssError(
                f"{self} is drop-frame (;), which {clock} frames a second do not have",
                remedy="Write : before the frame, or take 29.97 or 59.94 frames a second",
            )
        if self.drop and left_out(self._label(base), base).item():
            raise DnnvssError(
                f"{self} is a number that drop-frame time code leaves out",
                remedy=f"Begin with frame {base // 15:02d}",
            )
        return base

    def codes(self, frames: int, clock: FrameClock) -> list[str]:
        """The time codes of so many frames; midnight is passed.

        Raises:
            DnnvssError: as :meth:`base`.
        """
        base = self.base(clock)
        count = self._label(base) + np.arange(frames)
        if self.drop:
            count = labels_of(frames_of(self._label(base), base) + np.arange(frames), base)
        seconds, frame = np.divmod(count, base)
        width = len(str(base - 1))
        return [
            f"{s // 3600 % 24:02d}:{s // 60 % 60:02d}:{s % 60:02d}{self._mark}{f:0{max(width, 2)}d}"
            for s, f in zip(seconds.tolist(), frame.tolist(), strict=True)
        ]

    def counted(self, clock: FrameClock, other: FrameClock) -> "TimeCode":
        """The same moment in a second as another rate counts it; drop-frame where that rate has it.

        Args:
            clock: whose frames this code counts.
            other: whose frames are to be counted.
        """
        frame = self.frame * round(other.rate) // max(1, round(clock.rate))
        return replace(self, frame=frame, drop=self.drop and has_drop_frame(other.rate))

    @property
    def _mark(self) -> str:
        return ";" if self.drop else ":"

    def _label(self, base: int) -> np.ndarray:
        """The number of the first frame (1,) since midnight, as if none were passed over."""
        seconds = (self.hours * 60 + self.minutes) * 60 + self.seconds
        return np.array([seconds * base + self.frame])

    def __str__(self) -> str:
        return f"{self.hours:02d}:{self.minutes:02d}:{self.seconds:02d}{self._mark}{self.frame:02d}"
