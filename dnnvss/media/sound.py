"""A sound in memory."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np


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
