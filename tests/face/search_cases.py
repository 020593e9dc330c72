"""The built-in talker as material for the search: pictures whose points are known exactly."""

from functools import cache

import cv2
import numpy as np

from dnnvss.corpus.talker import LANDMARK_GROUPS, film, landmark_track, perform_take, script
from dnnvss.face.aam.search.choose import spread_out
from dnnvss.face.aam.search.fit import fit_search
from dnnvss.face.aam.search.model import SearchModel

SIZE = 160
GROUPS = ("lips_outer", "lips_inner", "jaw", "nose_base")
ROWS = np.concatenate([np.arange(*LANDMARK_GROUPS[g]) for g in GROUPS])
LIPS = slice(0, sum(LANDMARK_GROUPS[g][1] - LANDMARK_GROUPS[g][0] for g in GROUPS[:2]))


@cache
def clip(number: int, frames: int = 40, size: int = SIZE) -> tuple[np.ndarray, np.ndarray]:
    """Return pictures (F, size, size, 3) and true points (F, P, 2) of the middle of a sentence."""
    name = f"demo_{number:03d}"
    rows = perform_take(name, script(number + 1)[name]).articulators[20:20 + frames]
    pictures = np.stack(list(film(rows, size, np.random.default_rng(number))))
    return pictures, landmark_track(rows, size)[:, ROWS]


@cache
def labelled() -> tuple[list[np.ndarray], np.ndarray]:
    """Return 24 pictures of different mouth shapes and their points (24, P, 2)."""
    pictures, points = (np.concatenate(parts) for parts in zip(*(clip(n) for n in range(3)), strict=True))
    shapes = (points - points.mean(axis=1, keepdims=True)).reshape(len(points), -1)
    chosen = spread_out(shapes, 24)
    return [pictures[i] for i in chosen], points[chosen]


@cache
def model() -> SearchModel:
    """Return the search model of the labelled pictures."""
    return fit_search(*labelled())


def error(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Return the mean distance (...,) in pixels of the lips' points (..., P, 2)."""
    return np.linalg.norm(found - true, axis=-1)[..., LIPS].mean(axis=-1)


def moved(picture: np.ndarray, right: float, down: float, larger: float = 1.0) -> np.ndarray:
    """Return a picture moved by some pixels on a grey ground, and larger."""
    matrix = np.array([[larger, 0, right], [0, larger, down]])
    return cv2.warpAffine(picture, matrix, picture.shape[1::-1], borderValue=(90, 100, 110))
