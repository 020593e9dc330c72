"""How numbers stand in tables and sentences: values, intervals, counts and p."""

from typing import Protocol

import numpy as np

NONE = "\u2013"
"""What stands where there is no number."""


class Ranged(Protocol):
    """A value with its interval."""

    @property
    def value(self) -> float:
        """The value; NaN where nothing was measured."""
        ...

    @property
    def low(self) -> float:
        """The lower end; NaN where there is no interval."""
        ...

    @property
    def high(self) -> float:
        """The upper end."""
        ...


def number(value: float, digits: int | None = None) -> str:
    """A number with so many decimals, a dash where there is none.

    Args:
        value: the number.
        digits: behind the point; where None three, two from 10 on. Zero has no sign.
    """
    places = digits if digits is not None else 3 if abs(value) < 10 else 2
    return NONE if np.isnan(value) else f"{value:z.{places}f}"


def interval(found: Ranged, digits: int | None = None) -> str:
    """A value with its interval, alone where it has none; ``digits`` as for :func:`number`."""
    alone = number(found.value, digits)
    return alone if np.isnan(found.low) else f"{alone} ({number(found.low, digits)} to {number(found.high, digits)})"


def number_of(count: int, thing: str) -> str:
    """A count with the name of what is counted: ``1 sentence``, ``2 sentences``."""
    return f"{count} {thing}{'' if count == 1 else 's'}"


def p_value(p: float) -> str:
    """A p with four decimals, a dash where there is none."""
    return NONE if np.isnan(p) else "< .0001" if p < 1e-4 else f"{p:.4f}"
