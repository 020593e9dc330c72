"""Where a scheme's points start: on the face that a detector finds, or where the picture moves as a mouth does."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from dnnvss.face.aam.labelling.schemes import MOUTH, Scheme

EYE_SHARE = 0.16
"""Distance of the eyes over the shorter side of the picture, where nothing better is known: head and shoulders."""
_EYES_IN_BOX = (0.39, 0.40)
"""Height of the eyes in a detector's box, and their distance, over its side."""
_BLUR = 0.03
"""Standard deviation of the blur that makes one hill of a moving mouth, over the picture's width."""


@dataclass(frozen=True)
class Guess:
    """Points (P, 2) in pixels to start from, and how they were placed."""

    points: np.ndarray
    how: str


def find_detector() -> Any | None:
    """Return OpenCV's face detector, or None where this OpenCV has none (version 5 ships no cascades)."""
    data = getattr(cv2, "data", None)
    if data is None or not hasattr(cv2, "CascadeClassifier"):
        return None
    path = Path(data.haarcascades) / "haarcascade_frontalface_default.xml"
    return cv2.CascadeClassifier(str(path)) if path.is_file() else None


def place(scheme: Scheme, image: np.ndarray, mouth: tuple[float, float] | None, detector: Any | None = None) -> Guess:
    """Return a scheme's layout placed in a picture.

    The largest face that the detector finds places it. Without one its size is that of a head-and-shoulders picture,
    its mouth lies where the picture moves, or the face stands in the middle where nothing moves.

    Args:
        scheme: the points.
        image: uint8 RGB (H, W_, 3).
        mouth: where the video moves most (:func:`moving_mouth`), in pixels.
        detector: what :func:`find_detector` returned.
    """
    height, width = image.shape[:2]
    if detector is not None:
        found = detector.detectMultiScale(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), 1.1, 5)
        if len(found):
            x, y, side, _ = max(found, key=lambda box: box[2])
            middle = np.array([x + side / 2, y + _EYES_IN_BOX[0] * side])
            return Guess(middle + _EYES_IN_BOX[1] * side * scheme.layout, "face detector")
    eyes = EYE_SHARE * min(height, width)
    if mouth is not None:
        return Guess(np.array(mouth) + eyes * (scheme.layout - MOUTH), "where the picture moves")
    return Guess(np.array([0.5, 0.4]) * (width, height) + eyes * scheme.layout, "middle of the picture")


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
