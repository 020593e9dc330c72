"""The energy of a sound."""

from dataclasses import dataclass

import numpy as np

from dnnvss.acoustics.analysis import Analysis
from dnnvss.settings import check_settings, setting


@dataclass(frozen=True)
class Energy(Analysis):
    """The mean power of a window: ``ln max(floor, sum_n (w_n x_n)^2 / sum_n w_n^2)``, ``w`` of Hann.

    Args:
        window: milliseconds of sound that a frame looks at.
        floor: the least power; a sine of amplitude 1 has 0.5.
        causal: whether the window ends with its frame.

    Raises:
        DnnvssError: a setting out of range.
    """

    window: float = setting(40.0, least=2, most=500, doc="milliseconds of sound that a frame looks at")
    floor: float = setting(1e-7, above=0, below=1, doc="least power; a sine of amplitude 1 has 0.5")
    causal: bool = setting(False, doc="whether the window ends with its frame")

    name = "energy"
    unit = "ln of power"
    spread = 2.0
    paper = "ours"

    def __post_init__(self) -> None:
        check_settings(self, "labels.energy")

    @property
    def columns(self) -> tuple[str, ...]:
        """One."""
        return ("energy",)

    @property
    def meaning(self) -> tuple[str, str]:
        """The power."""
        return "the power of all frequencies", f"{self.where} (energy {self.key})"

    def rows(self, pieces: np.ndarray) -> np.ndarray:
        """The energy (n, 1) of windows (n, N)."""
        window = np.hanning(self.samples + 1)[:-1]
        mean = ((pieces * window) ** 2).sum(axis=1, keepdims=True) / (window**2).sum()
        return np.log(np.maximum(mean, self.floor))
