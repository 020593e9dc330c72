"""Encoding of whole clips: pose over time, outliers, the clip's mean, and the error of reconstruction."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from dnnvss.face.aam.code import ClipCode
from dnnvss.face.aam.light import steadied
from dnnvss.face.aam.model import ActiveAppearanceModel
from dnnvss.face.base import APERTURE, LOWER_LIP
from dnnvss.face.clips import Clip, UnusableClipError
from dnnvss.face.lips import mouth_gauges
from dnnvss.face.outliers import shape_distance
from dnnvss.face.pose import to_reference
from dnnvss.robust import robust_limit
from dnnvss.timing import bridged, fill_invalid

_CHUNK = 64
"""Frames whose textures are held as floats at a time."""
_LOOSE = 0.4
"""Deviations of a gauge by which the face may show the mouth otherwise than the points: a frame in a hundred misses by
more on a face of ten clips of GRID, one in six hundred on that of all."""
_HELD = (APERTURE, LOWER_LIP)
_LENIENT = 3.0
"""A clip that fits the model worse as a whole, by other light or clothes, may have limits so many times the model's."""


@dataclass(frozen=True)
class Measured:
    """What was seen of a clip: reference shapes (F, P, 2), textures (F, N, 3) uint8 under one light, and its code."""

    shapes: np.ndarray
    textures: np.ndarray
    code: ClipCode


def encode_clip(
    model: ActiveAppearanceModel, images: np.ndarray, points: np.ndarray, valid: np.ndarray, rate: float,
    name: str = "clip",
) -> ClipCode:
    """Return the code of a clip of pictures (F, H, W_, 3), all their landmarks (F, L, 2) in pixels, and valid (F,).

    Head pose is measured on the stable points and smoothed; light that changes within the clip is taken out
    (:mod:`dnnvss.face.aam.light`); frames that are far out for the model and for the clip itself are outliers. Gaps of
    up to :data:`dnnvss.timing.BRIDGE` seconds are bridged, other outliers are marked invalid. The clip's mean shape
    and texture over its measured frames become its offsets (zero where the model keeps clip means).
    Errors call the clip by its ``name``.

    Raises:
        UnusableClipError: no frame is usable.
    """
    clip = Clip(name, rate, lambda: (points, valid), lambda: images)
    return measure_clip(model, clip).code


def measure_clip(model: ActiveAppearanceModel, clip: Clip) -> Measured:
    """Return shapes, textures and code of a clip (see :func:`encode_clip`)."""
    points, valid = clip.read_points(model.layout.needed)
    layout, limits = model.layout, model.limits
    far = {"stable points": valid & (model.reference.residual(points[:, layout.stable]) > limits.stable)}
    valid = valid & ~far["stable points"]
    _need(valid, clip.id)
    shapes, _ = _shapes(model, points, valid, clip.rate)
    centre = np.median(shapes[valid], axis=0)
    far["shape"] = valid & (shape_distance(shapes, centre, model.spread) > limits.shape)
    valid = valid & ~far["shape"]
    _need(valid, clip.id)
    shapes, pose = _shapes(model, points, valid, clip.rate)
    pictures = zip(clip.pictures(len(points)), points[:, layout.rows], strict=True)
    textures = np.stack([model.read_texture(picture, place) for picture, place in pictures])
    textures = steadied(model.skin, textures, valid)
    far["texture"] = _far_textures(model, shapes, textures, valid)
    valid = valid & ~far["texture"]
    _need(valid, clip.id)
    outliers = {reason: np.flatnonzero(mask).tolist() for reason, mask in far.items() if mask.any()}
    return Measured(shapes, textures, _code(model, shapes, textures, pose, valid, outliers, clip.rate))


def reconstruct(model: ActiveAppearanceModel, code: ClipCode) -> tuple[np.ndarray, np.ndarray]:
    """Return points (F, P, 2) in picture pixels and textures (F, N, 3) of a clip, with its offsets and pose."""
    points, textures = model.decode(code.parameters)
    return model.place(points + code.shape_offset, code.pose), textures + code.texture_offset


def frame_residuals(model: ActiveAppearanceModel, images: np.ndarray, landmarks: np.ndarray, code: ClipCode
                    ) -> tuple[np.ndarray, np.ndarray]:
    """What the model leaves out of each frame (F,): of the points in picture pixels, of the texture in grey levels.

    Args:
        model: that the clip was encoded with.
        images, landmarks: of the clip, (F, H, W_, 3) and (F, L, 2).
        code: of the clip.
    """
    placed, textures = reconstruct(model, code)
    own = model.modelled(landmarks)
    pixels = np.sqrt(((placed - own) ** 2).sum(axis=-1).mean(axis=-1))
    read = [model.warp.sample(i, p) for i, p in zip(images, own, strict=True)]
    grey = [np.sqrt(((a.astype(np.float32) - b) ** 2).mean()) for a, b in zip(read, textures, strict=True)]
    return pixels, np.array(grey)


def clip_errors(model: ActiveAppearanceModel, measured: Measured) -> np.ndarray:
    """Return squared errors (2, 2) summed over the clip's valid frames and their number of frames, as (3, 2).

    Rows: with the clip's offsets, without them, count. Columns: mean squared distance of the points in picture pixels,
    mean squared difference of the texture in grey levels, each summed over frames.
    """
    code = measured.code
    keep = np.flatnonzero(code.valid)
    scale = np.hypot(code.pose[keep, 0], code.pose[keep, 1])
    gap = measured.shapes[keep] - model.points(code.parameters[keep])
    gaps = [gap - code.shape_offset, gap]
    pixels = [((g**2).sum(axis=-1).mean(axis=-1) * scale**2).sum() for g in gaps]
    greys = np.zeros(2)
    for start in range(0, len(keep), _CHUNK):
        part = keep[start:start + _CHUNK]
        without = measured.textures[part] - model.decode_texture(code.parameters[part])
        greys += [((without - code.texture_offset) ** 2).mean(axis=(1, 2)).sum(), (without**2).mean(axis=(1, 2)).sum()]
    return np.array([*zip(pixels, greys, strict=True), (len(keep), len(keep))], dtype=np.float64)


def _shapes(
    model: ActiveAppearanceModel, points: np.ndarray, valid: np.ndarray, rate: float
) -> tuple[np.ndarray, np.ndarray]:
    pose = model.reference.poses(points[:, model.layout.stable], valid, rate)
    return to_reference(points[:, model.layout.rows], pose, model.reference.pivot), pose


def _far_textures(
    model: ActiveAppearanceModel, shapes: np.ndarray, textures: np.ndarray, valid: np.ndarray
) -> np.ndarray:
    """Return the valid frames (F,) whose texture the model does not know, about the clip's own centre.

    The mean as centre is fast and enough where nothing is far out; but what is far out pulls it, and then the median
    decides, and a frame counts that is far out among the clip's own as well.
    """
    limits = np.array([model.limits.texture, model.limits.parameters])
    measured = _misfits(model, shapes, textures, valid, np.mean)
    if not (measured[valid] > limits).any():
        return np.zeros_like(valid)
    measured = _misfits(model, shapes, textures, valid, np.median)
    own = np.array([robust_limit(m, model.config.outlier) for m in measured[valid].T])
    far = (measured > np.maximum(limits, np.minimum(own, _LENIENT * limits))).any(axis=1)
    return far & valid


def _misfits(
    model: ActiveAppearanceModel, shapes: np.ndarray, textures: np.ndarray, valid: np.ndarray,
    centre: Callable[..., np.ndarray],
) -> np.ndarray:
    """Return for each frame (F, 2) what the limits of texture and parameters are for, about the clip's centre."""
    shape, texture = centre(shapes[valid], axis=0), centre(textures[valid], axis=0).astype(np.float32)
    found = np.empty((len(shapes), 2))
    for part, parameters, centred in _projected(model, shapes - shape, textures, texture):
        residual = centred - np.tensordot(parameters, model.texture_modes, axes=1)
        found[part, 0] = np.sqrt((residual**2).mean(axis=(1, 2)))
        found[part, 1] = np.sqrt(((parameters / model.deviations) ** 2).mean(axis=1))
    return found


def _projected(
    model: ActiveAppearanceModel, shapes: np.ndarray, textures: np.ndarray, centre: np.ndarray
) -> Iterator[tuple[slice, np.ndarray, np.ndarray]]:
    """Yield frames, their parameters and their centred textures, a chunk at a time: long clips do not fit as floats."""
    for start in range(0, len(shapes), _CHUNK):
        part = slice(start, start + _CHUNK)
        centred = textures[part] - centre
        yield part, model.project(shapes[part], centred), centred


def _code(
    model: ActiveAppearanceModel, shapes: np.ndarray, textures: np.ndarray, pose: np.ndarray, valid: np.ndarray,
    outliers: dict[str, list[int]], rate: float,
) -> ClipCode:
    shape_offset, texture_offset = np.zeros_like(model.mean_shape), np.zeros_like(model.mean_texture)
    if model.config.clip_means:
        shape_offset = shapes[valid].mean(axis=0) - model.mean_shape
        texture_offset = textures[valid].mean(axis=0, dtype=np.float32) - model.mean_texture
    centre = model.mean_texture + texture_offset
    moved = shapes - model.mean_shape - shape_offset
    parameters = np.concatenate([found for _, found, _ in _projected(model, moved, textures, centre)])
    parameters = with_lips(model, parameters, moved)
    return ClipCode(fill_invalid(parameters, valid), pose.astype(np.float32), shape_offset.astype(np.float32),
                    texture_offset.astype(np.float32), valid | bridged(valid, rate), outliers)


def with_lips(model: ActiveAppearanceModel, parameters: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Parameters (F, D) whose mouth is hardly elsewhere than that of the points.

    Shape and texture are read together, and a texture that the training clips never showed (a tongue between the lips
    looks like shut lips) draws the shape with it. Where a gauge ``v`` misses what the points say by more than
    :data:`_LOOSE` of its deviation, the parameters move until it does not, by as little as they can in units of their
    deviations: ``p + S V (V^T S V)^-1 e`` with ``S`` their variances and ``e`` what the gauges miss beyond that.

    Args:
        model: that the parameters belong to.
        parameters: as projected.
        moved: how the points differ from the clip's mean (F, P, 2).
    """
    layout = model.layout
    seen = mouth_gauges(model.mean_shape, moved, layout.outer, layout.inner)
    vectors = np.stack([model.gauges[name].vector for name in _HELD], axis=1)
    gap = np.stack([seen[name].vector for name in _HELD], axis=1) - parameters @ vectors
    carried = np.asarray(model.deviations, float)[:, None] ** 2 * vectors
    form = vectors.T @ carried
    loose = _LOOSE * np.sqrt(np.diag(form))
    beyond = np.sign(gap) * np.maximum(np.abs(gap) - loose, 0)
    return np.asarray(parameters + beyond @ np.linalg.pinv(form, hermitian=True) @ carried.T, parameters.dtype)


def _need(valid: np.ndarray, utterance: str) -> None:
    if not valid.any():
        raise UnusableClipError("no frame has usable landmarks", utterance=utterance,
                                remedy="Drop the utterance from the corpus, or give landmarks of better quality")
