"""Encoding of whole clips: pose over time, outliers, and the clip's mean."""

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.clips import Clip, UnusableClipError
from dnnvss.face.outliers import shape_distance
from dnnvss.face.points.code import PointsCode
from dnnvss.face.points.model import PointsFace
from dnnvss.face.points.pose import taken_out
from dnnvss.timing import bridged, fill_invalid


def encode_points(face: PointsFace, clip: Clip) -> tuple[PointsCode, np.ndarray]:
    """The code of a clip, and its shapes (F, P, 2 or 3) in the reference frame.

    Head pose is measured on the stable points and smoothed; frames beyond the face's limits are outliers, which gaps
    of up to :data:`dnnvss.timing.BRIDGE` seconds bridge and which are marked invalid elsewhere. The clip's mean shape
    over its measured frames becomes its offset (zero where the face keeps clip means).

    Raises:
        UnusableClipError: no frame is usable.
        DnnvssError: landmarks of another number or with other coordinates than the face's.
    """
    points, valid = clip.read_points(face.layout.needed, (face.dimensions,))
    if points.shape[1] != len(face.whole_mean):
        raise DnnvssError(f"has {points.shape[1]} landmarks a frame, the face has {len(face.whole_mean)}",
                          utterance=clip.id, remedy="Track the recording with the markup of the face's corpus")
    far = {"stable points": valid & (face.reference.residual(points[:, face.layout.stable]) > face.limits.stable)}
    valid = _left(valid, far["stable points"], clip.id)
    shapes, _ = _shapes(face, points, valid, clip.rate)
    away = shape_distance(shapes, np.median(shapes[valid], axis=0), face.spread)
    far["shape"] = valid & (away > face.limits.shape)
    valid = _left(valid, far["shape"], clip.id)
    shapes, pose = _shapes(face, points, valid, clip.rate)
    sizes = face.project(shapes - np.median(shapes[valid], axis=0)) / face.deviations
    far["parameters"] = valid & (np.sqrt((sizes**2).mean(axis=1)) > face.limits.parameters)
    valid = _left(valid, far["parameters"], clip.id)
    offset = shapes[valid].mean(axis=0) - face.mean if face.settings.clip_means else np.zeros_like(face.mean)
    parameters = fill_invalid(face.project(shapes - face.mean - offset), valid)
    outliers = {reason: np.flatnonzero(mask).tolist() for reason, mask in far.items() if mask.any()}
    code = PointsCode(parameters, pose.astype(np.float32), offset.astype(np.float32),
                      valid | bridged(valid, clip.rate), outliers)
    return code, shapes


def point_errors(face: PointsFace, code: PointsCode, shapes: np.ndarray) -> np.ndarray:
    """Sums over a clip's valid frames of the mean squared distance of the points, with and without the clip's offset.

    Returns:
        (3,): with the offset, without it, and the number of frames.
    """
    keep = code.valid
    gap = shapes[keep] - face.points(code.parameters[keep])
    squared = [float((g**2).sum(axis=-1).mean(axis=-1).sum()) for g in (gap - code.shape_offset, gap)]
    return np.array([*squared, keep.sum()], dtype=np.float64)


def _shapes(face: PointsFace, points: np.ndarray, valid: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    pose = face.reference.poses(points[:, face.layout.stable], valid, rate)
    return taken_out(points[:, face.layout.rows], pose, face.reference), pose


def _left(valid: np.ndarray, far: np.ndarray, utterance: str) -> np.ndarray:
    left = valid & ~far
    if not left.any():
        raise UnusableClipError("no frame has usable landmarks", utterance=utterance,
                                remedy="Drop the utterance from the corpus, or give landmarks of better quality")
    return left
