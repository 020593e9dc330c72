"""What goes into the model and what comes out: clips of a corpus, and their codes."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.corpus import Corpus, Utterance
from dnnvss.errors import DnnvssError
from dnnvss.media import read_video


@dataclass(frozen=True)
class Clip:
    """A stretch of video with landmarks, read only when it is asked for.

    Args:
        id: the utterance's id.
        rate: frames a second.
        landmarks: returns points (F, L, 2) in pixels and valid (F,) bool.
        images: returns the pictures, uint8 RGB (F, H, W_, 3).
    """

    id: str
    rate: float
    landmarks: Callable[[], tuple[np.ndarray, np.ndarray]]
    images: Callable[[], np.ndarray]

    def read_points(self, needed: int) -> tuple[np.ndarray, np.ndarray]:
        """Return points (F, L, 2) float64 and valid (F,); points that are not finite make their frame invalid.

        Raises:
            DnnvssError: arrays of the wrong shape, or fewer than ``needed`` landmarks.
        """
        points, valid = self.landmarks()
        points = np.asarray(points, dtype=np.float64)
        if points.ndim != 3 or points.shape[1] < needed or points.shape[2] != 2 or valid.shape != points.shape[:1]:
            raise DnnvssError(f"landmarks have shape {points.shape} and valid {valid.shape}, and (F, {needed} or more, "
                              "2) and (F,) are needed", utterance=self.id,
                              remedy="Choose the point set of this corpus in conf/aam")
        finite = np.isfinite(points).all(axis=(1, 2))
        return np.where(finite[:, None, None], points, 0.0), valid & finite

    def read_images(self, frames: int) -> np.ndarray:
        """Return the pictures (F, H, W_, 3), one for each landmark frame.

        Raises:
            DnnvssError: there are more or fewer pictures than landmark frames.
        """
        images = self.images()
        if len(images) != frames:
            raise DnnvssError(f"has {len(images)} pictures and {frames} frames of landmarks", utterance=self.id,
                              remedy="Prepare the corpus again")
        return images


def corpus_clips(corpus: Corpus, utterances: Iterable[Utterance]) -> list[Clip]:
    """Return the clips of utterances; nothing is read yet."""
    corpus = replace(corpus, utterances={})  # the records of all would travel to the workers with every clip
    return [Clip(u.id, float(u.rate), partial(corpus.landmarks, u), partial(_video, corpus, u)) for u in utterances]


def _video(corpus: Corpus, utterance: Utterance) -> np.ndarray:
    return read_video(corpus.path(utterance, "video"))


@dataclass(frozen=True)
class ClipCode:
    """A clip as parameters of the model, with what is needed to put it back into its picture.

    Args:
        parameters: (F, D) float32; frames that are not valid are interpolated between their neighbours.
        pose: (F, 4) float32, smoothed head pose (see :mod:`dnnvss.face.aam.pose`).
        shape_offset: (P, 2) float32, the clip's mean shape less the model's.
        texture_offset: (N, 3) float32, the clip's mean texture less the model's.
        valid: (F,) bool; False where the landmarks were, or where the frame is an outlier.
        outliers: reason to the frames that were left out for it.
    """

    parameters: np.ndarray
    pose: np.ndarray
    shape_offset: np.ndarray
    texture_offset: np.ndarray
    valid: np.ndarray
    outliers: dict[str, list[int]] = field(default_factory=dict)

    def save(self, path: str | Path, **more: np.ndarray) -> Path:
        """Write the code, and ``more`` arrays beside it, as ``.npz`` and return the path."""
        names = sorted(self.outliers)
        return files.write_arrays(
            path, parameters=self.parameters, pose=self.pose, shape_offset=self.shape_offset,
            texture_offset=self.texture_offset.astype(np.float16), valid=self.valid,
            outlier_reasons=np.array(names, dtype=str),
            outlier_frames=np.array([[n in self.outliers and f in self.outliers[n] for f in range(len(self.valid))]
                                     for n in names], dtype=bool), **more)

    @classmethod
    def load(cls, path: str | Path) -> "ClipCode":
        """Return a code that :meth:`save` wrote.

        Raises:
            DnnvssError: the file is missing or damaged.
        """
        remedy = "Delete it and run the command again"
        arrays = files.read_arrays(path, remedy)
        missing = {"parameters", "pose", "shape_offset", "texture_offset", "valid", "outlier_reasons",
                   "outlier_frames"} - set(arrays)
        if missing:
            raise DnnvssError(f"lacks {sorted(missing)}", file=path, remedy=remedy)
        marks = zip(arrays["outlier_reasons"], arrays["outlier_frames"], strict=True)
        outliers = {str(reason): np.flatnonzero(row).tolist() for reason, row in marks}
        return cls(arrays["parameters"], arrays["pose"], arrays["shape_offset"],
                   arrays["texture_offset"].astype(np.float32), arrays["valid"], outliers)


def stacked(values: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return arrays of one clip each laid end to end, and the edges (clips + 1,) between them."""
    return np.concatenate(values), np.cumsum([0, *map(len, values)])
