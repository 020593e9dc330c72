"""Fitting the search model to labelled frames, and learning from them when a search has failed."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.aam.search.find import Found, search
from dnnvss.face.aam.search.model import SearchLimits, SearchModel, SearchSettings, build
from dnnvss.robust import robust_limit

_FOLDS = 5
_DEVIATIONS = 6.0
"""Robust standard deviations beyond which a frame's error counts as lost."""
_SLACK, _LEAST = 3.0, 0.03
"""The limit is no less than this multiple of the median error of frames that the model had not seen, nor than this."""
_BLUR = 0.4
"""Share of the median sharpness of the labelled frames below which a frame counts as blurred."""
_SHAPE = 2.2
_UNBOUND = SearchLimits(1.0, np.inf, 0.0)


def fit_search(images: Sequence[np.ndarray], points: np.ndarray, settings: SearchSettings | None = None) -> SearchModel:
    """Return the search model of labelled pictures.

    The limits come from the labelled frames: each is searched by a model of the others, from the mean shape in its
    place, and the errors that this leaves say what a frame that was found may measure.

    Args:
        images: N pictures (H, W_, 3) uint8 RGB of any sizes.
        points: (N, P, 2) in their pixels; any set of points in one order.
        settings: how to fit; the defaults where None.

    Raises:
        DnnvssError: too few frames or points, points that are not finite or outside their picture, or on one line.
    """
    settings = settings or SearchSettings()
    points = np.asarray(points, np.float64)
    _check(images, points)
    folds = min(_FOLDS, len(images) // 2) if len(images) >= 6 else 0
    unseen = [f for k in range(folds) for f in _held_out(images, points, settings, k, folds)]
    model = build(images, points, settings, _UNBOUND)
    if not unseen:
        unseen = [search(model, i, p) for i, p in zip(images, points, strict=True)]
    return replace(model, limits=learn_limits(unseen))


def learn_limits(found: Sequence[Found]) -> SearchLimits:
    """Return the limits that frames known to be right set (robust, so that a few wrong ones among them do no harm)."""
    errors = np.array([f.error for f in found])
    return SearchLimits(robust_limit(errors, _DEVIATIONS, max(_SLACK * float(np.median(errors)), _LEAST)),
                  max(robust_limit(np.array([f.unusual for f in found]), _DEVIATIONS), _SHAPE),
                  _BLUR * float(np.median([f.sharpness for f in found])))


def _held_out(images: Sequence[np.ndarray], points: np.ndarray, settings: SearchSettings, fold: int, folds: int
              ) -> list[Found]:
    kept = [i for i in range(len(images)) if i % folds != fold]
    model = build([images[i] for i in kept], points[kept], settings, _UNBOUND)
    return [search(model, images[i], model.shapes.nearest(points[i])) for i in range(fold, len(images), folds)]


def _check(images: Sequence[np.ndarray], points: np.ndarray) -> None:
    if points.ndim != 3 or points.shape[2] != 2 or len(points) != len(images):
        raise DnnvssError(f"{len(images)} pictures and points of the shape {points.shape}; (pictures, points, 2) is "
                          "needed", remedy="Give the same points of every labelled frame")
    for number, (image, own) in enumerate(zip(images, points, strict=True)):
        height, width = image.shape[:2]
        if not np.isfinite(own).all() or (own < -0.2 * width).any() or (own > 1.2 * max(width, height)).any():
            raise DnnvssError(f"points of labelled frame {number} are not in its picture of {width} x {height} pixels",
                              remedy="Label that frame again")
