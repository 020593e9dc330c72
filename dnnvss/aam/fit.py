"""Fitting the model to the clips of a training split, in two passes: landmarks of all, then textures of some."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import joblib
import numpy as np
from tqdm import tqdm

from dnnvss.aam.clips import Clip
from dnnvss.aam.config import AAMConfig
from dnnvss.aam.mesh import Warp, triangulate
from dnnvss.aam.model import ActiveAppearanceModel
from dnnvss.aam.outliers import (
    LEAST_PARAMETERS,
    LEAST_SHAPE,
    LEAST_STABLE,
    LEAST_TEXTURE,
    Limits,
    robust_limit,
    shape_distance,
    spread_of,
    texture_distance,
)
from dnnvss.aam.pca import Components, components
from dnnvss.aam.points import Layout
from dnnvss.aam.pose import PoseReference, mean_shape, to_reference
from dnnvss.errors import DnnvssError

_BATCH = 32
"""Clips handed to the workers at a time; bounds the memory and lets the progress bar move."""


@dataclass(frozen=True)
class _Shapes:
    """Pass 1: a clip's landmarks of the model (F, P, 2) in pixels, in the reference frame, and the frames kept (F,)."""

    points: np.ndarray
    shapes: np.ndarray
    keep: np.ndarray

    @property
    def mean(self) -> np.ndarray:
        return self.shapes[self.keep].mean(axis=0)


def fit_aam(
    clips: Sequence[Clip],
    groups: Mapping[str, tuple[int, int]],
    config: AAMConfig | None = None,
    *,
    progress: bool = True,
) -> ActiveAppearanceModel:
    """Return the model fitted to clips.

    Frames that are not valid, or far out by a robust rule, take no part. Work is shared out by joblib; the caller
    chooses the backend with ``joblib.parallel_config``.

    Args:
        clips: the training clips.
        groups: the corpus's landmark groups.
        config: the settings; the defaults where None.
        progress: show a progress bar.

    Raises:
        DnnvssError: no usable frame, or a point set that does not fit the corpus.
    """
    config = config or AAMConfig()
    layout = config.points.layout(groups)
    reference, tracked, stable_limit = _track(clips, layout, config)
    spread, shape_limit = _shape_limits(tracked, config)
    tracked = [_without_far(t, spread, shape_limit) for t in tracked]
    usable = [i for i, t in enumerate(tracked) if t.keep.any()]
    mean = np.mean([tracked[i].mean for i in usable], axis=0)
    shapes = np.concatenate([tracked[i].shapes[tracked[i].keep] for i in usable])
    opened = _open_shape(shapes, layout)
    warp = Warp(opened if config.texture_shape == "open" else mean, triangulate(opened), config.scale)
    chosen = _choose(tracked, usable, config)
    textures = _read_textures(clips, tracked, chosen, warp, progress)
    centred_shapes, centred_textures, mean_texture = _centred(tracked, chosen, textures, mean, config)
    found = _modes(centred_shapes, centred_textures, config)
    limits = _limits(found, centred_shapes, centred_textures, stable_limit, shape_limit, config)
    return ActiveAppearanceModel(
        config, {g: (int(a), int(b)) for g, (a, b) in groups.items()}, reference, mean, warp, mean_texture,
        found.shape_modes, found.texture_modes, found.weight, found.deviations, spread, limits)


def _track(clips: Sequence[Clip], layout: Layout, config: AAMConfig) -> tuple[PoseReference, list[_Shapes], float]:
    """Return the pose reference, every clip's shapes in its frame, and the limit of the stable points."""
    read = [clip.read_points(layout.needed) for clip in clips]
    if not any(valid.any() for _, valid in read):
        raise DnnvssError(f"none of the {len(clips)} training clips has a valid frame of landmarks",
                          remedy="Prepare the corpus again; its report says why frames were dropped")
    seen = np.concatenate([p[v][::config.texture_every, layout.stable] for p, v in read])
    reference = PoseReference(mean_shape(seen), config.pose_smoothing)
    residuals = [reference.residual(p[:, layout.stable]) for p, _ in read]
    measured = np.concatenate([r[v] for r, (_, v) in zip(residuals, read, strict=True)])
    limit = robust_limit(measured, config.outlier, LEAST_STABLE)
    tracked = []
    for clip, (points, valid), residual in zip(clips, read, residuals, strict=True):
        keep = valid & (residual <= limit)
        pose = reference.poses(points[:, layout.stable], keep, clip.rate)
        own = points[:, layout.rows]
        tracked.append(_Shapes(own, to_reference(own, pose, reference.pivot), keep))
    return reference, tracked, limit


def _shape_limits(tracked: Sequence[_Shapes], config: AAMConfig) -> tuple[np.ndarray, float]:
    """Return the robust spread (P, 2) of each coordinate about its clip's median, and the limit of the distance."""
    usable = [t for t in tracked if t.keep.any()]
    centred = np.concatenate([t.shapes[t.keep] - np.median(t.shapes[t.keep], axis=0) for t in usable])
    spread = spread_of(centred)
    return spread, robust_limit(shape_distance(centred, np.zeros_like(spread), spread), config.outlier, LEAST_SHAPE)


def _without_far(tracked: _Shapes, spread: np.ndarray, limit: float) -> _Shapes:
    if not tracked.keep.any():
        return tracked
    centre = np.median(tracked.shapes[tracked.keep], axis=0)
    near = shape_distance(tracked.shapes, centre, spread) <= limit
    return _Shapes(tracked.points, tracked.shapes, tracked.keep & near)


def _open_shape(shapes: np.ndarray, layout: Layout) -> np.ndarray:
    """Return the mean of the twentieth of shapes whose inner mouth is largest: there the lips' contours lie apart.

    Triangles chosen on the mean shape, where the lips nearly touch, would run across from lip to lip. And a texture
    kept on the mean shape has no room for teeth: on GRID its mouth is 2.6 pixels high, and the inside of an open mouth
    (7 pixels) read into it and drawn again differs by 7.6 grey levels from the video, by 2.4 through the open shape.
    """
    x, y = np.moveaxis(shapes[:, layout.inner], -1, 0)
    area = np.abs((x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1))
    return shapes[np.argsort(area)[-max(1, len(area) // 20):]].mean(axis=0)


def _choose(tracked: Sequence[_Shapes], usable: Sequence[int], config: AAMConfig) -> dict[int, np.ndarray]:
    """Return clip number to the frames whose texture is read: every nth of randomly drawn clips until enough."""
    random = np.random.default_rng(config.seed)
    chosen: dict[int, np.ndarray] = {}
    count = 0
    for clip in random.permutation(usable):
        if count >= config.texture_frames:
            break
        frames = np.flatnonzero(tracked[clip].keep)
        step = min(config.texture_every, len(frames))
        chosen[int(clip)] = frames[int(random.integers(step))::step]
        count += len(chosen[int(clip)])
    return dict(sorted(chosen.items()))


def _read_textures(
    clips: Sequence[Clip], tracked: Sequence[_Shapes], chosen: Mapping[int, np.ndarray], warp: Warp, progress: bool
) -> list[np.ndarray]:
    """Return for each chosen clip the textures (n, N, 3) uint8 of its chosen frames."""
    jobs = [joblib.delayed(_sample)(clips[i], tracked[i].points, frames, warp) for i, frames in chosen.items()]
    textures: list[np.ndarray] = []
    with tqdm(total=len(jobs), desc="reading textures", unit="clip", disable=not progress) as bar:
        for start in range(0, len(jobs), _BATCH):
            textures += joblib.Parallel()(jobs[start:start + _BATCH])
            bar.update(len(textures) - bar.n)
    return textures


def _sample(clip: Clip, points: np.ndarray, frames: np.ndarray, warp: Warp) -> np.ndarray:
    images = clip.read_images(len(points))
    return np.stack([warp.sample(images[f], points[f]) for f in frames])


def _centred(
    tracked: Sequence[_Shapes], chosen: Mapping[int, np.ndarray], textures: Sequence[np.ndarray], mean: np.ndarray,
    config: AAMConfig,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return centred shapes (n, P, 2) and textures (n, N, 3) of the frames that stay, and the mean texture (N, 3)."""
    middles = [np.median(t, axis=0) for t in textures]
    distances = [texture_distance(t, m) for t, m in zip(textures, middles, strict=True)]
    limit = robust_limit(np.concatenate(distances), config.outlier, LEAST_TEXTURE)
    near = [d <= limit for d in distances]
    near = [n if n.any() else n | True for n in near]
    means = [t[n].mean(axis=0, dtype=np.float32) for t, n in zip(textures, near, strict=True)]
    mean_texture = np.stack(means).mean(axis=0)
    count = sum(int(n.sum()) for n in near)
    flat_textures = np.empty((count, *mean_texture.shape), dtype=np.float32)
    flat_shapes = np.empty((count, *mean.shape), dtype=np.float64)
    row = 0
    for (clip, frames), texture, own, kept in zip(chosen.items(), textures, means, near, strict=True):
        part = slice(row, row + int(kept.sum()))
        flat_textures[part] = texture[kept] - (own if config.clip_means else mean_texture)
        flat_shapes[part] = tracked[clip].shapes[frames[kept]] - (tracked[clip].mean if config.clip_means else mean)
        row = part.stop
    flat_shapes -= flat_shapes.mean(axis=0)  # the chosen frames' own mean is not exactly the clips'
    flat_textures -= flat_textures.mean(axis=0)
    return flat_shapes, flat_textures, mean_texture


@dataclass(frozen=True)
class _Found:
    shape_modes: np.ndarray
    texture_modes: np.ndarray
    weight: float
    deviations: np.ndarray


def _modes(shapes: np.ndarray, textures: np.ndarray, config: AAMConfig) -> _Found:
    """Return modes of both kinds in one form (see :class:`ActiveAppearanceModel`)."""
    count, width = len(shapes), shapes[0].size
    flat_shapes, flat_textures = shapes.reshape(count, -1), textures.reshape(count, -1)
    if config.kind == "separate":
        shape = components(flat_shapes, config.shape_modes, config.seed)
        texture = components(flat_textures, config.texture_modes, config.seed)
        return _side_by_side(shape, texture, shapes.shape[1:], textures.shape[1:])
    ratio = float((flat_textures**2).sum(dtype=np.float64) / max(float((flat_shapes**2).sum()), 1e-12))
    weight = config.shape_weight * float(np.sqrt(ratio))
    both = components(np.hstack([(weight * flat_shapes).astype(np.float32), flat_textures]), config.modes, config.seed)
    return _Found((both.modes[:, :width] / weight).reshape(-1, *shapes.shape[1:]),
                  both.modes[:, width:].reshape(-1, *textures.shape[1:]).astype(np.float32), weight, both.deviations)


def _side_by_side(shape: Components, texture: Components, points: tuple, pixels: tuple) -> _Found:
    first, second = len(shape.modes), len(texture.modes)
    shape_modes, texture_modes = np.zeros((first + second, *points)), np.zeros((first + second, *pixels), np.float32)
    shape_modes[:first] = shape.modes.reshape(-1, *points)
    texture_modes[first:] = texture.modes.reshape(-1, *pixels)
    return _Found(shape_modes, texture_modes, 1.0, np.concatenate([shape.deviations, texture.deviations]))


def _limits(
    found: _Found, shapes: np.ndarray, textures: np.ndarray, stable: float, shape: float, config: AAMConfig
) -> Limits:
    """Return the limits of all four measures; texture and parameters are measured on the frames of the fit."""
    count = len(shapes)
    flat_modes = found.texture_modes.reshape(len(found.deviations), -1)
    flat = textures.reshape(count, -1)
    parameters = found.weight**2 * shapes.reshape(count, -1) @ found.shape_modes.reshape(len(flat_modes), -1).T
    parameters = parameters + flat @ flat_modes.T
    residual = np.array([np.sqrt(np.mean((row - p @ flat_modes) ** 2))
                         for row, p in zip(flat, parameters.astype(np.float32), strict=True)])
    size = np.sqrt(((parameters / found.deviations) ** 2).mean(axis=1))
    return Limits(stable, shape, robust_limit(residual, config.outlier, LEAST_TEXTURE),
                  robust_limit(size, config.outlier, LEAST_PARAMETERS))
