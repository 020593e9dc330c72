"""What faces are fitted to and encode: stretches of a corpus with landmarks, and pictures where there are some."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from dnnvss.corpus import Corpus, Utterance
from dnnvss.errors import DnnvssError
from dnnvss.media import read_video


class UnusableClipError(DnnvssError):
    """No frame of a clip can be used."""


@dataclass(frozen=True)
class Clip:
    """A recording with landmarks, read only when it is asked for.

    Args:
        id: the utterance's id.
        rate: frames a second.
        landmarks: returns points (F, L, 2 or 3) and valid (F,) bool.
        images: returns the pictures, uint8 RGB (F, H, W_, 3).
    """

    id: str
    rate: float
    landmarks: Callable[[], tuple[np.ndarray, np.ndarray]]
    images: Callable[[], np.ndarray]

    def read_points(self, needed: int, coordinates: Sequence[int] = (2,)) -> tuple[np.ndarray, np.ndarray]:
        """Points (F, L, 2 or 3) float64 and valid (F,); points that are not finite make their frame invalid.

        Args:
            needed: landmarks that there must be at least.
            coordinates: how many a point may have.

        Raises:
            DnnvssError: arrays of the wrong shape, or fewer landmarks.
        """
        points, valid = self.landmarks()
        points = np.asarray(points, dtype=np.float64)
        fits = points.ndim == 3 and points.shape[1] >= needed and points.shape[2] in coordinates
        if not fits or valid.shape != points.shape[:1]:
            wanted = " or ".join(map(str, coordinates))
            raise DnnvssError(f"landmarks have shape {points.shape} and valid {valid.shape}, and (F, {needed} or more, "
                              f"{wanted}) and (F,) are needed", utterance=self.id,
                              remedy="Choose the point set of this corpus (conf/aam for face=aam)")
        finite = np.isfinite(points).all(axis=(1, 2))
        return np.where(finite[:, None, None], points, 0.0), valid & finite

    def read_images(self, frames: int) -> np.ndarray:
        """The pictures (F, H, W_, 3), one for each landmark frame.

        Raises:
            DnnvssError: there are more or fewer pictures than landmark frames.
        """
        images = self.images()
        if len(images) != frames:
            raise DnnvssError(f"has {len(images)} pictures and {frames} frames of landmarks", utterance=self.id,
                              remedy="Prepare the corpus again")
        return images


def corpus_clips(corpus: Corpus, utterances: Iterable[Utterance]) -> list[Clip]:
    """The clips of utterances; nothing is read yet."""
    corpus = replace(corpus, utterances={})  # the records of all would travel to the workers with every clip
    return [Clip(u.id, float(u.rate), partial(corpus.landmarks, u), partial(_video, corpus, u)) for u in utterances]


def _video(corpus: Corpus, utterance: Utterance) -> np.ndarray:
    if utterance.video is None:
        raise DnnvssError("has no pictures", utterance=utterance.id, file=corpus.root,
                          remedy="Choose a face that needs none: face=points")
    return read_video(corpus.path(utterance, "video"))
