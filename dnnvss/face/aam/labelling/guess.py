"""Where a scheme's points start: on the face that a detector finds, or where the picture moves as a mouth does."""

from dataclasses import dataclass

import cv2
import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.aam.labelling.mesh import on_mesh
from dnnvss.face.aam.labelling.schemes import MOUTH, Scheme
from dnnvss.face.landmarker import SURE, Landmarker, find_task

EYE_SHARE = 0.16
"""Distance of the eyes over the shorter side of the picture, where nothing better is known: head and shoulders."""
_BLUR = 0.03
"""Standard deviation of the blur that makes one hill of a moving mouth, over the picture's width."""


@dataclass(frozen=True)
class Guess:
    """Points (P, 2) in pixels to start from, and how they were placed."""

    points: np.ndarray
    how: str


def find_detector() -> Landmarker | None:
    """The landmarker, or None where its nets are not installed (``make extras``)."""
    try:
        return Landmarker(find_task())
    except DnnvssError:
        return None


def place(scheme: Scheme, image: np.ndarray, mouth: tuple[float, float] | None, detector: Landmarker | None = None
          ) -> Guess:
    """A scheme's points placed in a picture.

    They lie on the largest face that the landmarker finds. Without one the layout has the size of a head-and-shoulders
    picture, its mouth lies where the picture moves, or the face stands in the middle where nothing moves.

    Args:
        scheme: the points.
        image: uint8 RGB (H, W_, 3).
        mouth: where the video moves most (:func:`moving_mouth`), in pixels.
        detector: what :func:`find_detector` returned.
    """
    height, width = image.shape[:2]
    if detector is not None and (mesh := _largest(detector, image)) is not None:
        return Guess(on_mesh(scheme, mesh), "face landmarks")
    eyes = EYE_SHARE * min(height, width)
    if mouth is not None:
        return Guess(np.array(mouth) + eyes * (scheme.layout - MOUTH), "where the picture moves")
    return Guess(np.array([0.5, 0.4]) * (width, height) + eyes * scheme.layout, "middle of the picture")


def _largest(detector: Landmarker, image: np.ndarray) -> np.ndarray | None:
    """The mesh (478, 2) of the largest face in a picture, None where there is none."""
    regions = detector.detect(image)
    if not regions:
        return None
    mesh, certainty = detector.refined(image, max(regions, key=lambda region: region.side))
    return mesh if certainty >= SURE else None


def moving_mouth(frames: np.ndarray) -> tuple[float, float] | None:
    """Return where (x, y) in pixels grey frames (F, H, W_) move most of the time, None where nothing does.

    A mouth moves in most frames, eyelids in few: the median over time of the differences tells them apart.
    """
    if len(frames) < 3:
        return None
    moved = np.abs(np.diff(frames.astype(np.int16), axis=0)).astype(np.float32)
    energy = cv2.GaussianBlur(np.median(moved, axis=0) + 0.1 * moved.mean(axis=0), (0, 0), _BLUR * frames.shape[2])
    y, x = np.unravel_index(int(energy.argmax()), energy.shape)
    return (float(x) + 0.5, float(y) + 0.5) if energy[y, x] - np.median(energy) > 1e-3 else None
