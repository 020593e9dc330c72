"""Search in one picture: from a start that is about right, or from nothing."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from dnnvss.face.aam.search.model import SearchModel
from dnnvss.face.aam.search.view import channels_of, crops_of

_SAME = 1.25
"""A face that is larger or smaller than the labelled ones by less is searched in the picture's own pixels."""
_PEAKS = 3
"""Places looked at for each size of face."""
_SIZES = tuple(float(s) for s in np.geomspace(0.4, 3.2, 13))
"""Sizes of face, beside the labelled ones, that are looked for in a picture of which nothing is known."""
_REACH = 0.2
"""How far the mean picture is moved to better a start, as a share of the face's size."""


@dataclass(frozen=True)
class Found:
    """What a search ended with.

    Args:
        points: (P, 2) in pixels of the picture.
        parameters: (K,) of the shape.
        error: share of the texture's contrast that the model does not explain, 0 to 1.
        sharpness: of the texture (:meth:`SearchModel.sharpness`).
        unusual: RMS shape parameter in standard deviations.
        outside: share of the points that lie outside the picture.
        iterations: steps over all levels.
    """

    points: np.ndarray
    parameters: np.ndarray
    error: float
    sharpness: float
    unusual: float
    outside: float
    iterations: int


def search(model: SearchModel, image: np.ndarray, start: np.ndarray, wide: bool = False) -> Found:
    """Return where the points are in a picture (H, W_, 3) uint8, from start points (P, 2) that are about right.

    Args:
        model: the search model.
        image: the picture.
        start: a guess: the points of the frame before, or of a detector.
        wide: first move the guess to where the mean picture fits best nearby; for guesses that are pixels off.
    """
    size = float(model.shapes.scale(start))
    size = 1.0 if 1 / _SAME < size < _SAME else float(np.clip(size, 1e-3, 1e3))
    if wide:
        start = _bettered(model, image, start)
    settings = model.settings
    points, parameters = model.shapes.project(np.asarray(start, np.float32).T / np.float32(size))
    iterations, error, texture = 0, 1.0, np.zeros(1)
    views = crops_of(image, points.T * size, size, [level.scale for level in model.levels], settings.colour)
    for level, view in zip(model.levels, views, strict=True):
        zoom, origin = view.zoom * np.float32(size), view.origin * view.zoom
        for _ in range(settings.iterations):
            texture = level.sample(view.image, points * zoom - origin)
            coefficients, left, error = level.explain(texture)
            moved, parameters = level.compose(points, level.step(coefficients, left, parameters))
            farthest = float(np.abs(moved - points).max())
            points = moved
            iterations += 1
            if farthest < settings.tolerance:
                break
    points = points.T * size
    height, width = image.shape[:2]
    outside = float(((points < 0) | (points > (width, height))).any(axis=1).mean())
    unusual = float(np.sqrt(((parameters / model.shapes.deviations) ** 2).mean()))
    return Found(points, parameters, error, model.sharpness(texture), unusual, outside, iterations)


def _bettered(model: SearchModel, image: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Return the start moved to where the mean picture correlates best within reach."""
    size, place = float(model.shapes.scale(start)), start.mean(axis=0)
    scale, reach = model.levels[0].scale, _REACH * model.size * float(model.shapes.scale(start))
    corner = place + model.corner * size - reach
    height, width = model.patch.shape
    zoom = scale / size
    window = int(width + 2 * reach * zoom), int(height + 2 * reach * zoom)
    matrix = np.array([[1 / zoom, 0, corner[0] + 0.5 / zoom - 0.5], [0, 1 / zoom, corner[1] + 0.5 / zoom - 0.5]])
    low = np.maximum(np.floor(corner).astype(int) - 2, 0)
    high = np.maximum(np.ceil(corner + np.array(window) / zoom).astype(int) + 2, low + 2)
    part = image[low[1]:high[1], low[0]:high[0]]
    if min(part.shape[:2]) < 2:
        return start
    matrix[:, 2] -= low
    seen = cv2.warpAffine(channels_of(part, "grey"), matrix, window, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
                          borderMode=cv2.BORDER_REPLICATE)
    score = cv2.matchTemplate(seen, model.patch, cv2.TM_CCOEFF_NORMED)
    y, x = np.unravel_index(int(score.argmax()), score.shape)
    return start + (np.array([x, y]) / zoom - reach)


def detect(model: SearchModel, image: np.ndarray, sizes: Sequence[float] = _SIZES, most: int = 4) -> list[Found]:
    """Return the faces found in a picture (H, W_, 3) uint8 of which nothing is known, the best first, none twice.

    The mean picture is correlated with the picture at several sizes; the search starts from the best places. What it
    ends with is returned whether it is a face or not: the caller judges by its error.

    Args:
        model: the search model.
        image: the picture.
        sizes: sizes of face beside the labelled ones.
        most: searches to start.
    """
    grey = channels_of(image, "grey")
    places = sorted((p for s in sizes for p in _places(model, grey, s)), key=lambda p: -p[0])
    starts: list[np.ndarray] = []
    for _, size, place in places:
        points = model.shapes.mean * size + place
        if all(np.linalg.norm(place - s.mean(axis=0)) > 0.3 * size * model.size for s in starts):
            starts.append(points)
        if len(starts) == most:
            break
    found = sorted((search(model, image, s) for s in starts), key=lambda f: f.error)
    several: list[Found] = []
    for f in found:
        if all(np.linalg.norm(f.points.mean(axis=0) - g.points.mean(axis=0)) > 0.5 * np.ptp(g.points, axis=0).max()
               for g in several):
            several.append(f)
    return several


def _places(model: SearchModel, grey: np.ndarray, size: float) -> list[tuple[float, float, np.ndarray]]:
    """Return scores, sizes and places (2,) of the mean shape where the mean picture correlates best."""
    zoom = model.levels[0].scale / size
    target = round(grey.shape[1] * zoom), round(grey.shape[0] * zoom)
    height, width = model.patch.shape
    if target[0] < width or target[1] < height:
        return []
    seen = cv2.resize(grey, target, interpolation=cv2.INTER_AREA if zoom < 1 else cv2.INTER_LINEAR)
    score = cv2.matchTemplate(seen, model.patch, cv2.TM_CCOEFF_NORMED)
    places = []
    for _ in range(_PEAKS):
        _, best, _, (x, y) = cv2.minMaxLoc(score)
        places.append((float(best), size, np.array([x, y]) / zoom - model.corner * size))
        score[max(y - height // 3, 0):y + height // 3 + 1, max(x - width // 3, 0):x + width // 3 + 1] = -1
    return places
