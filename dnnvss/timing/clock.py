"""The only place that converts between seconds and frames."""

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.settings import shown

_NTSC = {Fraction(s): Fraction(n, 1001) for s, n in
         [("23.976", 24000), ("23.98", 24000), ("29.97", 30000), ("59.94", 60000), ("119.88", 120000)]}

_FASTEST = 1_000_000
"""Frames or samples a second beyond which a rate is a mistake."""


@dataclass(frozen=True)
class FrameClock:
    """A constant frame rate, kept as a fraction so that it never drifts.

    Frame ``i`` stands for ``[i / rate, (i + 1) / rate)``. Times are rounded to frame *edges*, halves upward, and
    durations are differences of edges, so that no frame is lost however many segments a tier has.

    Args:
        rate: frames a second; ``25``, ``"30000/1001"`` and ``"29.97"`` (which means 30000/1001) are all understood.
    """

    rate: Fraction

    def __init__(self, rate: "int | float | str | Fraction") -> None:
        try:
            exact = Fraction(str(rate)) if not isinstance(rate, Fraction) else rate
        except (ValueError, ZeroDivisionError, OverflowError) as error:
            raise DnnvssError(f"frame rate {rate!r} is not a number", remedy="Give frames a second, e.g. 25, 29.97 or "
                              "30000/1001") from error
        exact = _NTSC.get(exact, exact).limit_denominator(1_000_000)
        if exact <= 0:
            raise DnnvssError(f"frame rate {rate!r} is not positive", remedy="Give frames a second, e.g. 25")
        if exact > _FASTEST:
            raise DnnvssError(f"frame rate {shown(rate)} is more than {_FASTEST}", remedy="Give frames a second")
        object.__setattr__(self, "rate", exact)

    @classmethod
    def from_setting(cls, value: Any, where: str) -> "FrameClock":
        """The clock that a setting gives.

        Raises:
            DnnvssError: it is no rate; the message names the setting.
        """
        try:
            if isinstance(value, bool) or not isinstance(value, int | float | str):
                raise DnnvssError("no rate")
            return cls(value)
        except DnnvssError as error:
            raise DnnvssError(f"{where}={shown(value)} is no frame rate",
                              remedy="Give frames a second, e.g. 25, 29.97 or 30000/1001") from error

    def edge(self, seconds: float) -> int:
        """Return the frame edge nearest to a time in seconds; halves go up."""
        return int(self.edges(np.array([seconds]))[0])

    def edges(self, seconds: np.ndarray) -> np.ndarray:
        """Return the frame edges (int64) nearest to times in seconds, of the same shape."""
        position = np.asarray(seconds, dtype=float) * self.rate.numerator / self.rate.denominator
        return np.floor(position + 0.5 + 1e-9).astype(np.int64)  # 1e-9: decimal halves such as 0.285 s stay halves

    def seconds(self, edge: int) -> float:
        """Return the time of a frame edge in seconds."""
        return float(edge / self.rate)

    def times(self, edges: np.ndarray) -> np.ndarray:
        """Return the times (float64) of frame edges in seconds, of the same shape."""
        return np.asarray(edges, dtype=float) * self.rate.denominator / self.rate.numerator

    def centres(self, count: int) -> np.ndarray:
        """Return the centre times (count,) of the first ``count`` frames in seconds."""
        return self.times(np.arange(count) + 0.5)

    def __str__(self) -> str:
        return str(self.rate)
