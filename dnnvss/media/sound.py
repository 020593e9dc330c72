"""A sound in memory."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

RATES = 1000, 384000
"""Least and most samples a second of a sound."""
LOUDEST = 64.0
"""A sample beyond this (36 dB over full scale) is taken for one in another unit."""


@dataclass(frozen=True)
class Sound:
    """One channel of sound.

    Args:
        samples: (n,) in [-1, 1].
        rate: samples a second.
        kept: a folder in which what is slow to work out of it is kept, named by its samples; None where nothing is.
        others: gives the recordings of the same talker, itself among them; None where no others are known.
    """

    samples: np.ndarray
    rate: int
    kept: Path | None = None
    others: "Callable[[], Iterable[Sound]] | None" = None

    @property
    def seconds(self) -> float:
        """How long it lasts."""
        return len(self.samples) / self.rate
