"""Learning from the model's own confident frames: thirty labels become some two hundred.

**Source**: Cosker et al. 2004, section 3 (semi-automatic labelling of the training pictures, after Cootes and Taylor).
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from dnnvss.face.aam.search.choose import farthest
from dnnvss.face.aam.search.find import Found, search
from dnnvss.face.aam.search.fit import learn_limits
from dnnvss.face.aam.search.model import SearchModel, build
from dnnvss.face.aam.search.track import OK, Track
from dnnvss.face.aam.search.view import crops_of

Frames = Callable[[], Iterable[np.ndarray]]
"""Reads a video anew: its frames (H, W_, 3) uint8, one after the other."""

_CONFIDENT = 0.75
"""Share of a video's good frames, those of least error, that are trusted."""


@dataclass(frozen=True)
class Labelled:
    """Pictures (H, W_, 3) uint8 of any sizes, and their points (N, P, 2)."""

    images: Sequence[np.ndarray]
    points: np.ndarray


def confident(track: Track) -> np.ndarray:
    """Return the frames (n,) of a track that can be trusted: good, of small error, and good on both sides."""
    good = track.flag == OK
    inner = good & np.concatenate([[False], good[:-1]]) & np.concatenate([good[1:], [False]])
    if not inner.any():
        return np.zeros(0, int)
    return np.flatnonzero(inner & (track.error <= np.quantile(track.error[inner], _CONFIDENT)))


def gather(model: SearchModel, videos: Sequence[tuple[Frames, Track]], count: int) -> Labelled:
    """Return ``count`` confident frames, farthest from each other in shape and appearance, with the points found.

    Args:
        model: the model that tracked the videos.
        videos: what reads the frames of each video, and its track. Videos are read one after the other, and those with
            chosen frames once more: few more pictures are held than are returned.
        count: how many frames, fewer where there are fewer.
    """
    places: list[tuple[int, int]] = []
    points: list[np.ndarray] = []
    codes: list[np.ndarray] = []
    for video, (frames, found) in enumerate(videos):
        for frame, picture in _picked(frames, confident(found)):
            places.append((video, frame))
            points.append(found.points[frame].astype(np.float64))
            codes.append(_code(model, picture, points[-1]))
    if not codes:
        return Labelled([], np.zeros((0, *model.shapes.mean.shape)))
    features = np.stack(codes)
    chosen = farthest(features / np.maximum(features.std(axis=0), 1e-9), min(count, len(features)))
    wanted = [places[i] for i in chosen]
    pictures = {(video, frame): picture for video, (frames, _) in enumerate(videos)
                for frame, picture in _picked(frames, [f for v, f in wanted if v == video])}
    return Labelled([pictures[place] for place in wanted], np.stack([points[i] for i in chosen]))


def retrain(model: SearchModel, labelled: Labelled, found: Labelled) -> SearchModel:
    """Return the model of the labelled frames and of the frames that it found itself.

    Shapes stay those of the labels: only what the face looks like is learnt anew, and what a good frame may measure.
    """
    images = [*labelled.images, *found.images]
    points = np.concatenate([labelled.points, found.points])
    unseen: list[Found] = []
    for fold in range(2):
        out = [i for i in range(len(labelled.images), len(images)) if i % 2 == fold]
        kept = sorted(set(range(len(images))) - set(out))
        half = build([images[i] for i in kept], points[kept], model.settings, model.limits, model.shapes)
        unseen += [search(half, images[i], points[i]) for i in out]
    fitted = build(images, points, model.settings, model.limits, model.shapes)
    return replace(fitted, limits=learn_limits(unseen)) if unseen else fitted


def _picked(frames: Frames, numbers: Sequence[int] | np.ndarray) -> Iterable[tuple[int, np.ndarray]]:
    """Yield the frames of these numbers, each with its number, in the order of the video."""
    wanted = {int(n) for n in numbers}
    if wanted:
        yield from ((n, picture) for n, picture in enumerate(islice(frames(), max(wanted) + 1)) if n in wanted)


def _code(model: SearchModel, image: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return what a frame looks like: parameters of shape and of the coarse appearance, for their standard light."""
    level = model.levels[0]
    size = float(model.shapes.scale(points))
    (view,) = crops_of(image, points, size, [level.scale], model.settings.colour)
    placed = view.inside(points.T.astype(np.float32))
    coefficients, _, _ = level.explain(level.sample(view.image, placed))
    gains = coefficients[level.channels:2 * level.channels]
    _, parameters = model.shapes.project((points.T / size).astype(np.float32))
    return np.concatenate([parameters, coefficients[2 * level.channels:] / max(float(np.linalg.norm(gains)), 1e-6)])
