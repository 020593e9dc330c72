"""Tracking a video: forward and backward from where the face is most certain, and starting again where it was lost."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from dnnvss.face.aam.search.find import Found, detect, search
from dnnvss.face.aam.search.model import SearchModel

FLAGS = ("ok", "restarted", "lost", "ambiguous", "outside", "blurred")
"""What became of a frame; only the first two are valid. A frame's flag is a position in this."""
OK, RESTARTED, LOST, AMBIGUOUS, OUTSIDE, BLURRED = range(len(FLAGS))

_SEEDS = 8
"""Frames in which a face is looked for to begin with."""
_JUMP, _GROWTH = 0.35, 1.2
"""The farthest that a face moves from frame to frame, in its own size, and the most that it grows."""
_RIVAL = 2.0
"""A second face whose error is within this multiple of the first's makes the first doubtful."""
_BLURRED = 4.0
"""A blurred face's error is within this multiple of the limit."""
_NEAR = (1.0, 0.87, 1.15)
"""Sizes of face, beside the last seen, that are tried first after a loss."""


@dataclass(frozen=True)
class Track:
    """The points of every frame of a video.

    Args:
        points: (F, P, 2) float32 in pixels; the best guess where a frame is not valid, NaN where there is none.
        error: (F,) float32 share of the texture's contrast that the model does not explain; 1 where nothing was found.
        flag: (F,) int8, positions in :data:`FLAGS`.
    """

    points: np.ndarray
    error: np.ndarray
    flag: np.ndarray

    @property
    def valid(self) -> np.ndarray:
        """Whether the points of a frame (F,) may be used."""
        return self.flag <= RESTARTED

    def counts(self) -> dict[str, int]:
        """Return how many frames have each flag."""
        return {name: int((self.flag == i).sum()) for i, name in enumerate(FLAGS)}


def track(model: SearchModel, frames: Sequence[np.ndarray], before: np.ndarray | None = None) -> Track:
    """Return the track of a video's frames (H, W_, 3) uint8 RGB of one size.

    The face is looked for in a few frames; from the one that fits best it is followed to the end, then to the
    beginning. A frame counts as lost when its error, its shape or its jump is beyond what labelled frames and faces
    do; the face is then looked for in the whole picture. Where two faces fit about equally and neither continues the
    track, the frames that follow are ambiguous; a frame with points outside the picture, or blurred, is not valid.

    Args:
        model: the search model.
        frames: the pictures.
        before: points (P, 2) of the frame before the first, where it is known: the face is followed from there.
    """
    if before is not None:
        results = _follow(model, frames, range(len(frames)), before, OK)
    else:
        seed, found, doubtful = _begin(model, frames)
        last, state = None if found is None else found.points, AMBIGUOUS if doubtful else OK
        results = _follow(model, frames, range(seed, len(frames)), last, state)
        results |= _follow(model, frames, range(seed - 1, -1, -1), last, state)
    return _gathered(model, [results[f] for f in range(len(frames))])


def judge(model: SearchModel, found: Found) -> int:
    """Return the flag of what a search ended with, were it alone: ok, lost, outside or blurred.

    A blurred picture of a face leaves more unexplained than a sharp one, though less than no face does.
    """
    limits = model.limits
    blurred = found.sharpness < limits.sharpness
    if found.error > limits.error * (_BLURRED if blurred else 1.0) or found.unusual > limits.shape:
        return LOST
    if found.outside > 0:
        return OUTSIDE
    return BLURRED if blurred else OK


def _begin(model: SearchModel, frames: Sequence[np.ndarray]) -> tuple[int, Found | None, bool]:
    """Return the frame to begin with, what was found there (None where nothing), and whether a second face fits too."""
    best: tuple[int, Found | None, bool] = (0, None, False)
    for frame in np.unique(np.linspace(0, len(frames) - 1, _SEEDS).round().astype(int)):
        faces = [f for f in detect(model, frames[frame]) if judge(model, f) == OK]
        if faces and (best[1] is None or faces[0].error < best[1].error):
            best = int(frame), faces[0], _rivals(faces)
    return best


def _rivals(faces: Sequence[Found]) -> bool:
    return len(faces) > 1 and faces[1].error < _RIVAL * faces[0].error


def _follow(
    model: SearchModel, frames: Sequence[np.ndarray], order: Iterable[int], last: np.ndarray | None, state: int
) -> dict[int, tuple[Found | None, int]]:
    """Return frame to what was found and its flag, in an order of neighbouring frames, from the last face seen.

    Args:
        model, frames: the search model and the video.
        order: the frames.
        last: points (P, 2) of the face seen before them, or in the first of them.
        state: ``AMBIGUOUS`` while the face that is followed may be the wrong one, else ``OK``.
    """
    results: dict[int, tuple[Found | None, int]] = {}
    for frame in order:
        found = search(model, frames[frame], last) if last is not None else None
        flag = judge(model, found) if found is not None else LOST
        if found is None or last is None or flag == LOST or not _continues(found, last):
            found, flag, state = _again(model, frames[frame], last, state)
        results[frame] = found, state if flag == OK or (flag == RESTARTED and state == AMBIGUOUS) else flag
        last = found.points if found is not None and flag in (OK, RESTARTED, BLURRED) else last
    return results


def _continues(found: Found, last: np.ndarray) -> bool:
    """Whether a face has neither jumped nor grown or shrunk at once."""
    size, before = (float(np.ptp(p, axis=0).max()) for p in (found.points, last))
    moved = float(np.linalg.norm(found.points.mean(axis=0) - last.mean(axis=0)))
    return moved < _JUMP * before and 1 / _GROWTH < size / before < _GROWTH


def _again(
    model: SearchModel, image: np.ndarray, last: np.ndarray | None, state: int
) -> tuple[Found | None, int, int]:
    """Return what is found in the whole picture, its flag, and the state from there on.

    A face that continues the last one is restarted, and as ambiguous as the last one was: the state stays.
    """
    sizes = _sizes(model, last)
    found: list[Found] = []
    for several in sizes:
        found = detect(model, image, several) if several else detect(model, image)
        faces = [f for f in found if judge(model, f) == OK]
        if faces:
            near = [f for f in faces if last is not None and _continues(f, last)]
            if near:
                return near[0], RESTARTED, state
            doubtful = _rivals(faces)
            return faces[0], AMBIGUOUS if doubtful else RESTARTED, AMBIGUOUS if doubtful else OK
    best = found[0] if found else None
    return best, judge(model, best) if best is not None else LOST, state


def _sizes(model: SearchModel, last: np.ndarray | None) -> list[list[float]]:
    """Return the sizes to try: those about the last seen, then all (an empty list)."""
    if last is None:
        return [[]]
    size = float(model.shapes.scale(last))
    return [[size * s for s in _NEAR], []]


def _gathered(model: SearchModel, results: Sequence[tuple[Found | None, int]]) -> Track:
    nothing = np.full(model.shapes.mean.shape, np.nan)
    points = np.stack([nothing if f is None else f.points for f, _ in results]).astype(np.float32)
    error = np.array([1.0 if f is None else f.error for f, _ in results], np.float32)
    return Track(points, error, np.array([flag for _, flag in results], np.int8))


