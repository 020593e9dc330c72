"""What the report of every encoding is made with: frames of speech, and variance between clips."""

from collections.abc import Sequence

import numpy as np

from dnnvss.corpus import Utterance
from dnnvss.phones import SILENCES


def between_share(clips: Sequence[np.ndarray]) -> np.ndarray:
    """The share (D,) of each column's variance that lies between clips.

    With clips of frames (F_i, D), the share is the variance of the clip means (each weighted by its frames) over the
    variance of all frames.
    """
    sizes = np.array([len(c) for c in clips], dtype=float)
    means = np.stack([c.mean(axis=0, dtype=np.float64) for c in clips])
    grand = sizes @ means / sizes.sum()
    between = sizes @ (means - grand) ** 2 / sizes.sum()
    total = sum(((c - grand) ** 2).sum(axis=0) for c in clips) / sizes.sum()
    return between / np.maximum(total, 1e-300)


def speech_span(utterance: Utterance, frames: int) -> slice:
    """The frames from the first phone's start to the last phone's end; all frames where nothing is spoken."""
    spoken = [s for s in utterance.alignment["phones"] if s.label not in SILENCES]
    if not spoken:
        return slice(0, frames)
    first, last = utterance.clock.edges(np.array([spoken[0].start, spoken[-1].end]))
    return slice(max(int(first), 0), min(int(last), frames))
