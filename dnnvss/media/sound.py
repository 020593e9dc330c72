"""A sound in memory."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Sound:
    """One channel of sound.

    Args:
        samples: (n,) in [-1, 1].
        rate: samples a second.
    """

    samples: np.ndarray
    rate: int

    @property
    def seconds(self) -> float:
        """How long it lasts."""
        return len(self.samples) / self.rate
