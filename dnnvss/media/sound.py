"""A sound in memory."""

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
    """

    samples: np.ndarray
    rate: int
    kept: Path | None = None

    @property
    def seconds(self) -> float:
        """How long it lasts."""
        return len(self.samples) / self.rate
