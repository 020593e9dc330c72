"""The two nets that find a face and 478 points on it.

**Source**: Bazarevsky et al., BlazeFace (2019); Kartynnik et al., Real-time facial surface geometry from monocular
video on mobile GPUs (2019). The weights are Google's, Apache-2.0 (``docs/licences.md``).
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np

from dnnvss.face.landmarker.engines import Net, load
from dnnvss.face.landmarker.layout import LEFT_CORNER, RIGHT_CORNER
from dnnvss.face.landmarker.task import DETECTOR, MESH, read_task

POINTS = 478
"""Points of a face: 468 of its surface, then five of each iris."""

WIDER = 1.5
"""Side of the square that the mesh looks at, in sizes of the face."""

_SEEN, _CROP = 128, 256  # pixels of the pictures that the detector and the mesh look at
_OVERLAP = 0.3  # share of two boxes from which they show the same face


@dataclass(frozen=True)
class Region:
    """A turned square of a picture that holds a face.

    Args:
        centre: x and y in pixels.
        side: its length in pixels.
        angle: radians by which the face is turned clockwise.
    """

    centre: tuple[float, float]
    side: float
    angle: float

    @classmethod
    def around(cls, points: np.ndarray, eyes: np.ndarray, wider: float) -> "Region":
        """The square around points (N, 2) on a face.

        Args:
            points: in pixels.
            eyes: the outer corners (2, 2) of the right and the left eye of the talker.
            wider: how many times the longer side of the points' box.
        """
        low, high = points.min(axis=0), points.max(axis=0)
        right, left = eyes
        angle = float(np.arctan2(left[1] - right[1], left[0] - right[0]))
        middle = (low + high) / 2
        return cls((float(middle[0]), float(middle[1])), float((high - low).max()) * wider, angle)

    def matrix(self, pixels: int) -> np.ndarray:
        """The map (2, 3) from a picture of so many pixels a side to the picture that the square lies in."""
        step = self.side / pixels
        turn = step * np.array([[np.cos(self.angle), -np.sin(self.angle)], [np.sin(self.angle), np.cos(self.angle)]])
        start = np.asarray(self.centre) - turn @ np.full(2, (pixels - 1) / 2)
        return np.concatenate([turn, start[:, None]], axis=1)


@dataclass(frozen=True)
class Landmarker:
    """Finds faces in pictures, and points on a face.

    Args:
        task: the file of the nets; see :func:`dnnvss.face.landmarker.task.find_task`.
    """

    task: Path

    @cached_property
    def _nets(self) -> tuple[Net, Net]:
        parts = read_task(self.task)
        return load(parts[DETECTOR], ("classificators", "regressors")), load(parts[MESH], ("Identity", "Identity_1"))

    def detect(self, picture: np.ndarray, least: float = 0.5) -> list[Region]:
        """The faces in a picture, the surest first.

        Args:
            picture: uint8 RGB (H, W_, 3).
            least: certainty from which something is a face.
        """
        side = max(picture.shape[:2])
        square = cv2.copyMakeBorder(picture, 0, side - picture.shape[0], 0, side - picture.shape[1],
                                    cv2.BORDER_CONSTANT)
        small = cv2.resize(square, (_SEEN, _SEEN), interpolation=cv2.INTER_AREA)
        scores, boxes = self._nets[0](small.astype(np.float32) / 127.5 - 1)
        return [_region(box * side / _SEEN) for box in _faces(scores[0, :, 0], boxes[0], least)]

    def mesh(self, picture: np.ndarray, region: Region) -> tuple[np.ndarray, float]:
        """Points on a face and how sure it is that there is one.

        Args:
            picture: uint8 RGB (H, W_, 3).
            region: where the face is.

        Returns:
            points (478, 2) float32 in pixels, and a certainty between 0 and 1.
        """
        back = region.matrix(_CROP)
        crop = cv2.warpAffine(picture, back, (_CROP, _CROP), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
                              borderMode=cv2.BORDER_REPLICATE)
        points, logit = self._nets[1](crop.astype(np.float32) / 255)
        own = points.reshape(POINTS, 3)[:, :2]
        found = own @ back[:, :2].T + back[:, 2] + 0.5  # from the corner of the picture, not the middle of a pixel
        return found.astype(np.float32), float(_sigmoid(logit.reshape(-1)[0]))

    def refined(self, picture: np.ndarray, region: Region) -> tuple[np.ndarray, float]:
        """What :meth:`mesh` gives through a square of the mesh's own: the detector's box is rough."""
        points, _ = self.mesh(picture, region)
        return self.mesh(picture, Region.around(points, points[[RIGHT_CORNER, LEFT_CORNER]], WIDER))


def _anchors() -> np.ndarray:
    """Centres (896, 2) of the detector's boxes, in pixels of what it sees: two a cell of 8 pixels, six a cell of 16."""
    found = []
    for cell, each in ((8, 2), (16, 6)):
        y, x = np.mgrid[:_SEEN // cell, :_SEEN // cell]
        centres = (np.stack([x, y], axis=-1).reshape(-1, 2) + 0.5) * cell
        found.append(centres.repeat(each, axis=0))
    return np.concatenate(found).astype(np.float32)


_ANCHORS = _anchors()


def _faces(logits: np.ndarray, rows: np.ndarray, least: float) -> list[np.ndarray]:
    """Rows (8, 2) of the boxes that show different faces: centre, size, then six points, the eyes first."""
    scores = _sigmoid(logits)
    kept = np.flatnonzero(scores >= least)
    if not len(kept):
        return []
    boxes = rows[kept].reshape(-1, 8, 2).copy()
    boxes[:, 0] += _ANCHORS[kept]
    boxes[:, 2:] += _ANCHORS[kept][:, None]
    corners = np.concatenate([boxes[:, 0] - boxes[:, 1] / 2, boxes[:, 1]], axis=1)
    chosen = cv2.dnn.NMSBoxes(corners.tolist(), scores[kept].tolist(), least, _OVERLAP)
    return [boxes[k] for k in np.asarray(chosen).reshape(-1)]


def _region(box: np.ndarray) -> Region:
    corners = np.stack([box[0] - box[1] / 2, box[0] + box[1] / 2])
    return Region.around(corners, box[2:4], WIDER)


def _sigmoid(value: np.ndarray) -> np.ndarray:
    return 1 / (1 + np.exp(-np.clip(value, -80, 80)))
