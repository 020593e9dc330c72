"""Finds broken pictures, off-colour clips and tracker ghosts before anything is fitted.

A damaged group of pictures decodes without complaint, and a landmark tracker follows ghosts in it. Both stand out when
clips are compared with themselves and with the rest of the corpus by measures that single bad clips cannot move:
medians and robust standard deviations (:mod:`dnnvss.robust`).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from dnnvss import robust
from dnnvss.corpus.similarity import fit_similarity

THUMBNAIL = (16, 12)
"""Width and height of the thumbnails that pictures are compared by."""

REPEATED = 0.05
"""Grey levels by which a picture that is the one before, stored again, may differ from it after compression."""

OFTEN = 0.1
"""Share of repeated pictures beyond which a video was recorded at a lower rate than it is stored at."""


ALIKE = 0.9
"""Share of the best part's likeness to the corpus from which another part of a clip shows the same scene. On GRID
damaged parts have 0.67 of it at most, and the clip least like the corpus 0.74 of the one most like it."""

ENOUGH = 100_000
"""Frames that tell what is usual of a face: an hour at 25 frames a second."""

SEAM = 2
"""Frames on either side of a cut that tell nothing of how a face moves."""


@dataclass(frozen=True)
class CheckupLimits:
    """What counts as an outlier.

    Args:
        jump: change between two pictures (mean grey levels of the thumbnails) over the corpus's median change, beyond
            which they are not of one scene.
        doubt: the same, beyond which the picture is suspect: where a damaged stretch ends, it jumps back.
        colour: distance of a clip's mean colour from the corpus's, in robust standard deviations.
        shape: distance of a face from the median face: root mean square over points, in robust standard deviations.
            A corpus that varies more has a higher limit: 1.6 times the 95th percentile of its frames.
        speed: the same for the change from one frame to the next, with 2.2 times the percentile.
        outside: share of a frame's points that may lie outside the picture, by more than a hundredth of its size.
        place: distance of centre and log scale from the clip's median, in robust standard deviations of the corpus.
    """

    jump: float = 9.0
    doubt: float = 4.5
    colour: float = 12.0
    shape: float = 2.75
    speed: float = 2.1
    outside: float = 0.05
    place: float = 25.0


LIMITS = CheckupLimits()


def thumbnails(frames: np.ndarray) -> np.ndarray:
    """Return thumbnails (F, 12, 16, 3) uint8 of frames (F, H, W_, 3) uint8."""
    return np.stack([cv2.resize(frame, THUMBNAIL, interpolation=cv2.INTER_AREA) for frame in frames])


def broken_pictures(clips: Mapping[str, np.ndarray], limits: CheckupLimits = LIMITS) -> dict[str, np.ndarray]:
    """Return for each clip which frames (F,) are broken pictures.

    Where the picture jumps, the clip is taken apart. The part that looks most like the median picture of the corpus is
    kept, and so is every longer one that looks like it: an editor has cut there. The frames next to a cut, and every
    other part, are broken.

    Args:
        clips: thumbnails (F, 12, 16, 3) of each clip.
        limits: the jump that counts.
    """
    changes = _relative_changes(clips)
    faces = {name: np.median(_standard(clip), axis=0) for name, clip in clips.items()}
    face = np.median(np.stack(list(faces.values())), axis=0)
    broken = {}
    for name, clip in clips.items():
        cuts = np.flatnonzero(changes[name] > limits.jump)
        parts = np.split(np.arange(len(clip)), cuts)
        likeness = [float((np.median(_standard(clip[part]), axis=0) * face).mean()) for part in parts if len(part)]
        parts = [part for part in parts if len(part)]
        mask = np.ones(len(clip), bool)
        for part, like in zip(parts, likeness, strict=True):
            if like == max(likeness) or (like >= ALIKE * max(likeness) and len(part) > 2 * SEAM):
                mask[part] = False
        for cut in cuts[cuts > 0]:
            if not mask[cut - 1 : cut + 1].any():
                mask[max(cut - SEAM, 0) : cut + SEAM] = True
        broken[name] = mask
    return broken


def jumps(clips: Mapping[str, np.ndarray], limits: CheckupLimits = LIMITS) -> dict[str, np.ndarray]:
    """Return for each clip the frames (F,) at which the picture jumps, though within one scene.

    Args:
        clips: thumbnails (F, 12, 16, 3) of each clip.
        limits: the jumps that count.
    """
    return {name: np.asarray((change > limits.doubt) & (change <= limits.jump))
            for name, change in _relative_changes(clips).items()}


def _relative_changes(clips: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the change (F,) from the picture before, over the median of the corpus's changes.

    Where pictures are stored twice (30 a second in a video of 60), repeats are no changes and do not count.
    """
    changes = {name: _changes(clip) for name, clip in clips.items()}
    pooled = np.concatenate(list(changes.values()))
    repeats = pooled <= REPEATED
    if OFTEN < repeats.mean() < 1:
        pooled = pooled[~repeats]
    usual = max(float(np.median(pooled)), REPEATED)
    return {name: change / usual for name, change in changes.items()}


def _changes(clip: np.ndarray) -> np.ndarray:
    """Return the mean absolute change (F,) in grey levels from the picture before; 0 for the first."""
    changes = np.abs(np.diff(clip.astype(np.float32), axis=0)).mean(axis=(1, 2, 3))
    return np.concatenate([[0.0], changes])


def _standard(clip: np.ndarray) -> np.ndarray:
    """Return grey thumbnails (F, 12 * 16) with mean 0 and standard deviation 1: free of exposure and colour."""
    grey = clip.astype(np.float32).mean(axis=-1).reshape(len(clip), -1)
    grey -= grey.mean(axis=1, keepdims=True)
    return grey / np.maximum(grey.std(axis=1, keepdims=True), 1e-3)


def outside(points: np.ndarray, size: Sequence[int], limits: CheckupLimits = LIMITS) -> np.ndarray:
    """Return the frames (F,) in which too many points lie outside the picture.

    Args:
        points: (F, P, 2) in pixels; NaN is not outside.
        size: width and height of the picture in pixels.
        limits: the share of points that may.
    """
    margin = 0.01 * max(size)
    away = ((points < -margin) | (points > np.asarray(size) + margin)).any(axis=2)
    return np.asarray(away.mean(axis=1) > limits.outside)


HELD = 5, 25
"""Frames in which points are those of the frame before, to a bit, from which no face was looked for there; of whole
numbers more, which a face that rests may keep to."""


def held(points: np.ndarray) -> np.ndarray:
    """Return the frames (F,) whose points are an earlier frame's, written again: a measurement never is the same twice.

    Args:
        points: (F, P, 2 or 3).
    """
    same = np.concatenate([[False], (np.diff(points, axis=0) == 0).all(axis=(1, 2))])
    known = points[np.isfinite(points)]
    least = HELD[bool((known == np.round(known)).all())]
    parts = np.split(np.arange(len(same)), np.flatnonzero(np.diff(same)) + 1)
    found = np.zeros(len(same), bool)
    for part in parts:
        found[part] = same[part[0]] and len(part) >= least
    return found


def off_colour(clips: Mapping[str, np.ndarray], limits: CheckupLimits = LIMITS) -> dict[str, float]:
    """Return the clips whose colour is far from the corpus's, with the distance in robust standard deviations.

    The colour of a clip is the median over its frames of the mean picture, its three channels centred on their mean, so
    that exposure does not count.
    """
    names = list(clips)
    colour = np.stack([np.median(clips[name].mean(axis=(1, 2)), axis=0) for name in names])
    colour -= colour.mean(axis=1, keepdims=True)
    away = colour - np.median(colour, axis=0)
    spread = np.maximum(robust.spread(away), 0.5)
    distance = np.abs(away / spread).max(axis=1)
    return {name: float(d) for name, d in zip(names, distance, strict=True) if d > limits.colour}


def ghosts(points: Mapping[str, np.ndarray], valid: Mapping[str, np.ndarray], limits: CheckupLimits = LIMITS,
           rows: Sequence[int] | None = None) -> dict[str, np.ndarray]:
    """Return for each clip which frames (F,) hold landmarks that cannot be the face, though marked valid.

    Faces are aligned to the median face by a similarity; the rest is compared with the corpus in robust standard
    deviations a coordinate, as a shape and as a change from the frame before. Centre and scale are compared with the
    clip's own median. What is usual is told by :data:`ENOUGH` frames, evenly spaced, where there are more.

    Args:
        points: (F, P, 2 or 3); frames that are not valid may be NaN.
        valid: (F,) bool, the frames that the tracker found and whose picture is whole.
        limits: the distances that count.
        rows: the points that are looked at; all of them where None.
    """
    kept = slice(None) if rows is None else np.asarray(rows)
    seen = _some(points, valid, kept)
    if not len(seen):
        return {name: np.zeros(len(v), bool) for name, v in valid.items()}
    face = np.median(seen[:: max(1, len(seen) // 5000)], axis=0)
    aligned, _ = _aligned(seen, face)
    middle = np.median(aligned, axis=0)
    spread = robust.spread(aligned - middle)
    spread = np.maximum(spread, max(0.2 * float(np.median(spread)), 1e-3 * float(np.ptp(face))))
    del seen, aligned
    told = {name: _Told.of(points[name][ok][:, kept], face, middle, spread) for name, ok in valid.items() if ok.any()}
    away = {name: np.abs(own.places - np.median(own.places, axis=0)) for name, own in told.items()}
    usual = robust.TO_SIGMA * np.median(np.concatenate(list(away.values())), axis=0)
    place_spread = np.maximum(usual, 1e-3 * np.array([*[np.ptp(face)] * face.shape[1], 1.0]))
    shape, speed = _limits(told.values(), limits)
    found = {}
    for name, ok in valid.items():
        bad = np.zeros(len(ok), bool)
        if name in told:
            index = np.flatnonzero(ok)
            bad[index] = told[name].shape > shape
            fast = (told[name].speed > speed) & (np.diff(index) == 1)
            bad[index[1:][fast]] = bad[index[:-1][fast]] = True
            bad[index] |= (away[name] / place_spread).max(axis=1) > limits.place
        found[name] = bad
    return found


def _some(points: Mapping[str, np.ndarray], valid: Mapping[str, np.ndarray], rows: slice | np.ndarray) -> np.ndarray:
    """Some of the points (N, P, 2 or 3) of the valid frames of all clips, evenly spaced; all frames where few."""
    step = max(1, -(-sum(int(v.sum()) for v in valid.values()) // ENOUGH))
    before, parts = 0, []
    for name, ok in valid.items():
        index = np.flatnonzero(ok)
        parts.append(points[name][index[-before % step :: step]][:, rows])
        before += len(index)
    return np.concatenate(parts)


@dataclass(frozen=True)
class _Told:
    """What is told of the valid frames of a clip.

    Args:
        shape: distance (F,) from the usual face.
        speed: of the change (F - 1,) from the frame before.
        places: centre and log scale (F, 3 or 4).
    """

    shape: np.ndarray
    speed: np.ndarray
    places: np.ndarray

    @classmethod
    def of(cls, points: np.ndarray, face: np.ndarray, middle: np.ndarray, spread: np.ndarray) -> "_Told":
        aligned, places = _aligned(points, face)
        return cls(_distance((aligned - middle) / spread), _distance(np.diff(aligned, axis=0) / spread), places)


def _distance(standard: np.ndarray) -> np.ndarray:
    return np.asarray(np.sqrt((standard**2).mean(axis=(1, 2))))


def _limits(told: Iterable[_Told], limits: CheckupLimits) -> tuple[float, float]:
    """Return the limits of shape and speed for a corpus of which this is told."""
    shapes, moves = (np.concatenate(rows) for rows in zip(*((t.shape, t.speed) for t in told), strict=True))
    usual_move = np.percentile(moves, 95) if len(moves) else 0.0
    return max(limits.shape, 1.6 * float(np.percentile(shapes, 95))), max(limits.speed, 2.2 * float(usual_move))


def _aligned(shapes: np.ndarray, face: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return shapes (N, P, 2 or 3) turned, scaled and moved onto a face, and where they are.

    Where they are: centre and log scale (N, 3 or 4), in pixels (millimetres) of the face.
    """
    if face.shape[1] == 3:
        pose = fit_similarity(shapes, face)
        bulk = -np.log(np.maximum(pose.scale, 1e-9)) * np.ptp(face)
        return pose.back(shapes, face.mean(axis=0)), np.column_stack([pose.centre, bulk])
    z, target = shapes[..., 0] + 1j * shapes[..., 1], face[:, 0] + 1j * face[:, 1]
    centre, middle = z.mean(axis=1, keepdims=True), target.mean()
    turn = (np.conj(z - centre) @ (target - middle)) / np.maximum((np.abs(z - centre) ** 2).sum(axis=1), 1e-9)
    moved = (z - centre) * turn[:, None] + middle
    size = np.log(np.maximum(np.abs(turn), 1e-9)) * np.ptp(face)
    return np.stack([moved.real, moved.imag], axis=-1), np.column_stack([centre[:, 0].real, centre[:, 0].imag, size])
