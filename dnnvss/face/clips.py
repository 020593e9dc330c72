"""What faces are fitted to and encode: stretches of a corpus with landmarks, and pictures where there are some."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from dnnvss.corpus import Corpus, Utterance
from dnnvss.errors import DnnvssError
from dnnvss.media import video_frames


class UnusableClipError(DnnvssError):
    """No frame of a clip can be used."""


@dataclass(frozen=True)
class Clip:
    """A recording with landmarks, read only when it is asked for.

    Args:
        id: the utterance's id.
        rate: frames a second.
        landmarks: returns points (F, L, 2 or 3) and valid (F,) bool.
        images: returns the pictures, uint8 RGB (H, W_, 3) each, one after the other or as an array.
    """

    id: str
    rate: float
    landmarks: Callable[[], tuple[np.ndarray, np.ndarray]]
    images: Callable[[], Iterable[np.ndarray]]

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

    def pictures(self, frames: int) -> Iterator[np.ndarray]:
        """Yield the pictures (H, W_, 3), one for each landmark frame; none is held when the next one is asked for.

        Raises:
            DnnvssError: there are more or fewer pictures than landmark frames; told at the end.
        """
        count = 0
        for image in self.images():
            count += 1
            if count <= frames:
                yield image
        if count != frames:
            raise DnnvssError(f"has {count} pictures and {frames} frames of landmarks", utterance=self.id,
                              remedy="Prepare the corpus again")


def corpus_clips(corpus: Corpus, utterances: Iterable[Utterance]) -> list[Clip]:
    """The clips of utterances; nothing is read yet."""
    corpus = replace(corpus, utterances={})  # the records of all would travel to the workers with every clip
    return [Clip(u.id, float(u.rate), partial(corpus.landmarks, u), partial(_video, corpus, u)) for u in utterances]


def _video(corpus: Corpus, utterance: Utterance) -> Iterator[np.ndarray]:
    if utterance.video is None:
        raise DnnvssError("has no pictures", utterance=utterance.id, file=corpus.root,
                          remedy="Choose a face that needs none: face=points")
    return video_frames(corpus.path(utterance, "video"))
