"""What the tracker sees of the lips in a video: three distances, free of where and how large the face is."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from dnnvss.face.landmarker import ROWS, Landmarker, as_arrays, follow
from dnnvss.face.landmarker.layout import LEFT_CORNER, LOWER_LIP, RIGHT_CORNER, UPPER_LIP

NOSE, RIGHT_MOUTH, LEFT_MOUTH = 2, 61, 291
"""Points of the face mesh: below the nose, and the outer corners of the mouth."""

NAMES = ("aperture", "width", "lower lip")
"""The distances, in the order of the tables."""


@dataclass(frozen=True)
class Lips:
    """Distances (F, 3) in the order of :data:`NAMES`, and which frames the face was seen in (F,) bool.

    In hundredths of the distance between the outer corners of the eyes: the inner lips apart, the corners of the mouth
    apart, and the lower lip's inner edge below the nose, along the face.
    """

    tracks: np.ndarray
    seen: np.ndarray

    def at(self, frames: np.ndarray) -> "Lips":
        """The same at other moments, given as frames with fractions (T,); seen where both neighbours are."""
        rows = np.arange(len(self.tracks))
        known = self.seen if self.seen.any() else np.ones_like(self.seen)
        seen = np.interp(frames, rows, self.seen.astype(float)) >= 1 - 1e-9
        return Lips(at(self.tracks[known], frames, rows[known]), seen)


def at(values: np.ndarray, frames: np.ndarray, rows: np.ndarray | None = None) -> np.ndarray:
    """Values (F, D) at other moments (T, D).

    Args:
        values: a row for each frame.
        frames: the moments, as frames with fractions (T,).
        rows: the frames (F,) that the values are of; all from the first where None.
    """
    known = np.arange(len(values)) if rows is None else rows
    return np.stack([np.interp(frames, known, column) for column in values.T], axis=1)


def see(landmarker: Landmarker, pictures: Iterable[np.ndarray]) -> Lips:
    """The lips in a video, those of the face that is there longest.

    Args:
        landmarker: the tracker.
        pictures: uint8 RGB (H, W_, 3) each.
    """
    tracks, frames = follow(landmarker, pictures)
    points, seen = as_arrays(tracks[0] if tracks else None, frames)
    return Lips(distances(points), seen)


def distances(points: np.ndarray) -> np.ndarray:
    """Distances (F, 3) of points (F, P, 2) in pixels, rows in the order of :data:`~dnnvss.face.landmarker.ROWS`."""
    right, left = _point(points, RIGHT_CORNER), _point(points, LEFT_CORNER)
    upper, lower, nose = (_point(points, p) for p in (UPPER_LIP, LOWER_LIP, NOSE))
    across = left - right
    wide = np.linalg.norm(across, axis=1)
    down = np.stack([-across[:, 1], across[:, 0]], axis=1) / wide[:, None]
    mouth = np.linalg.norm(_point(points, LEFT_MOUTH) - _point(points, RIGHT_MOUTH), axis=1)
    found = [np.linalg.norm(lower - upper, axis=1), mouth, ((lower - nose) * down).sum(axis=1)]
    return 100 * np.stack(found, axis=1).astype(float) / wide[:, None]


def _point(points: np.ndarray, name: int) -> np.ndarray:
    return np.asarray(points[:, int(np.flatnonzero(name == ROWS)[0])], dtype=float)
