"""Whether landmarks stand in the picture as faces do."""

from collections.abc import Mapping

import numpy as np

STEEP = 0.5
"""Least height of the eyes over the lips, in widths by which they stand beside them: a head on its side is none."""


def eyes_apart(points: np.ndarray, valid: np.ndarray, groups: Mapping[str, tuple[int, int]]) -> float:
    """Pixels by which the left eye stands to the right of the right one, as faces in pictures have it; 0 if unknown.

    Args:
        points, valid, groups: as in :func:`askew`.
    """
    if not valid.any() or not {"right_eye", "left_eye"} <= groups.keys():
        return 0.0
    right, left = (points[valid, slice(*groups[name])].mean(axis=1)[:, 0] for name in ("right_eye", "left_eye"))
    return float(np.median(left - right))


def askew(points: np.ndarray, valid: np.ndarray, groups: Mapping[str, tuple[int, int]]) -> str:
    """Why landmarks cannot be those of a face in a picture, nothing where they can.

    Args:
        points: (F, P, 2) in pixels, down from the upper left corner.
        valid: (F,) which frames count.
        groups: name to half-open range of points; without eyes and lips nothing is said.
    """
    eyes = [points[valid, slice(*groups[name])].mean(axis=1) for name in ("right_eye", "left_eye") if name in groups]
    lips = next((points[valid, slice(*groups[name])].mean(axis=1) for name in ("lips_outer", "lips_inner")
                 if name in groups), None)
    if len(eyes) < 2 or lips is None or not valid.any():
        return ""
    across, down = np.median(lips - (eyes[0] + eyes[1]) / 2, axis=0)
    if down > STEEP * abs(across):
        return ""
    where = "above" if -down > STEEP * abs(across) else "beside"
    return (f"its landmarks have the lips {where} the eyes: y counts from the bottom there, x and y are swapped, or "
            "they are of pictures that are turned. Give points (x, y) in pixels from the upper left corner")
