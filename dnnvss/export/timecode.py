"""Time codes: hours, minutes, seconds and frames, as cutting rooms and capture programs count."""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.timing import FrameClock

_CODE = re.compile(r"(\d{1,2}):(\d{1,2}):(\d{1,2})[:;](\d{1,3})", re.ASCII)
_REMEDY = "Give hours:minutes:seconds:frame, such as 01:00:00:00"


@dataclass(frozen=True)
class TimeCode:
    """The time code of a first frame.

    Frames are counted in the whole number nearest to the rate: 29.97 frames a second count to 30 and
    fall behind the clock, as non-drop time code does.

    Args:
        hours, minutes, seconds, frame: each within its place.
    """

    hours: int = 0
    minutes: int = 0
    seconds: int = 0
    frame: int = 0

    @classmethod
    def from_setting(cls, value: Any, where: str) -> "TimeCode":
        """The time code that a text gives.

        Raises:
            DnnvssError: it is none.
        """
        found = _CODE.fullmatch(str(value))
        parts = [int(part) for part in found.groups()] if found else [99] * 4
        if parts[0] > 23 or parts[1] > 59 or parts[2] > 59:
            raise DnnvssError(f"{where}={value!r} is no time code", remedy=_REMEDY)
        return cls(*parts)

    def base(self, clock: FrameClock) -> int:
        """How many frames a second are counted.

        Raises:
            DnnvssError: the first frame's number is not below that.
        """
        base = max(1, round(float(clock.rate)))
        if self.frame >= base:
            raise DnnvssError(
                f"the time code begins with frame {self.frame}, and there are {base} a second",
                remedy=_REMEDY,
            )
        return base

    def codes(self, frames: int, clock: FrameClock) -> list[str]:
        """The time codes of so many frames; midnight is passed.

        Raises:
            DnnvssError: the first frame's number is not below the rate.
        """
        base = self.base(clock)
        first = (self.hours * 60 + self.minutes) * 60 + self.seconds
        count = first * base + self.frame + np.arange(frames)
        seconds, frame = np.divmod(count, base)
        width = len(str(base - 1))
        return [
            f"{s // 3600 % 24:02d}:{s // 60 % 60:02d}:{s % 60:02d}:{f:0{max(width, 2)}d}"
            for s, f in zip(seconds.tolist(), frame.tolist(), strict=True)
        ]

    def __str__(self) -> str:
        return f"{self.hours:02d}:{self.minutes:02d}:{self.seconds:02d}:{self.frame:02d}"
