"""Luminance alone is modelled, and the colour is that of the nearest training frame.

**Source**: Cosker et al. 2004, sections 3 and 5: pictures in YIQ, Y modelled, I and Q added from the training frame
that is nearest to the drawn one. Here the colour is kept as R - Y, G - Y, B - Y, which is I and Q in another basis;
about the mean of its clip, so that a clip's white balance does not flicker into the speech.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

_WEIGHTS = np.array([0.299, 0.587, 0.114], dtype=np.float32)
"""Red, green and blue in Y."""
_MOST = 400
"""Training frames whose colours are kept."""


def luminance(texture: np.ndarray) -> np.ndarray:
    """Return a texture (..., 3) uint8 without its colour: Y in all three channels, (..., 3) uint8."""
    grey = (texture.astype(np.float32) @ _WEIGHTS).round().astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=-1)


@dataclass(frozen=True)
class ColourBank:
    """Colours of training frames.

    Args:
        parameters: (K, D) of the frames.
        chroma: (K, N, 3) int8, what their colour adds to their luminance.
    """

    parameters: np.ndarray
    chroma: np.ndarray

    @classmethod
    def fit(cls, textures: Sequence[np.ndarray], parameters: np.ndarray, centred: bool) -> "ColourBank":
        """Return the bank of evenly spread frames.

        Args:
            textures: (n_i, N, 3) uint8 of each clip, with their colour.
            parameters: (n, D) of the frames of all clips, in order.
            centred: each clip's mean colour is replaced by the mean of all.
        """
        clips = [t.astype(np.float32) - luminance(t) for t in textures]
        means = [c.mean(axis=0) for c in clips]
        grand = np.mean(means, axis=0)
        rows = np.concatenate([c - m + grand for c, m in zip(clips, means, strict=True)] if centred else clips)
        kept = np.unique(np.linspace(0, len(rows) - 1, min(_MOST, len(rows))).astype(int))
        return cls(parameters[kept].astype(np.float32), np.clip(rows[kept], -127, 127).round().astype(np.int8))

    def nearest(self, parameters: np.ndarray) -> np.ndarray:
        """Return the colours (..., N, 3) float32 of the frames nearest to parameters (..., D)."""
        wanted = np.asarray(parameters, dtype=np.float32)
        distance = ((wanted[..., None, :] - self.parameters) ** 2).sum(axis=-1)
        return self.chroma[distance.argmin(axis=-1)].astype(np.float32)

    def arrays(self) -> dict[str, Any]:
        """Return the bank as named arrays for a file."""
        return {"colour_parameters": self.parameters, "colour_chroma": self.chroma}

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray]) -> "ColourBank":
        """Return the bank of :meth:`arrays`."""
        return cls(arrays["colour_parameters"], arrays["colour_chroma"])
