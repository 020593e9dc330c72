"""Fitting the model to the clips of a training split, in two passes: landmarks of all, then textures of some."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.aam.colour import ColourBank, luminance
from dnnvss.face.aam.config import AAMConfig
from dnnvss.face.aam.decomposition import find_modes
from dnnvss.face.aam.light import Skin, steadied
from dnnvss.face.aam.mesh import Warp, triangulate
from dnnvss.face.aam.model import ActiveAppearanceModel
from dnnvss.face.aam.outliers import LEAST_TEXTURE, FrameLimits, texture_distance
from dnnvss.face.aam.parts import supports
from dnnvss.face.clips import Clip
from dnnvss.face.outliers import LEAST_PARAMETERS, LEAST_SHAPE, LEAST_STABLE, shape_distance, spread_of
from dnnvss.face.point_set import Layout
from dnnvss.face.pose import PoseReference, mean_shape, to_reference
from dnnvss.progress import counted
from dnnvss.robust import robust_limit

_MEMORY = 2**30
"""Bytes that the textures of the fit may take as floats."""
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
        DnnvssError: no usable frame, too few of them, a point set that does not fit the corpus, or modes of parts that
            the kind of model does not use.
    """
    config = config or AAMConfig()
    if config.kind == "separate" and (counted := [part.name for part in config.parts if part.modes]):
        raise DnnvssError(f"aam.parts gives {counted[0]} modes of its own, which aam.kind=separate does not look at",
                          remedy="Leave them out (aam.shape_modes and aam.texture_modes hold for each part), or set "
                                 "aam.kind=combined")
    config = replace(config, points=config.points.fitted(groups))
    layout = config.points.layout(groups)
    reference, tracked, stable_limit = _track(clips, layout, config)
    spread, shape_limit = _shape_limits(tracked, config)
    tracked = [_without_far(t, spread, shape_limit) for t in tracked]
    usable = [i for i, t in enumerate(tracked) if t.keep.any()]
    mean = np.mean([tracked[i].mean for i in usable], axis=0)
    shapes = np.concatenate([tracked[i].shapes[tracked[i].keep] for i in usable])
    opened = _open_shape(shapes, layout)
    warp = Warp(opened if config.texture_shape == "open" else mean, triangulate(opened), config.scale)
    chosen = _choose(tracked, usable, len(warp.pixels), config)
    skin = Skin.of(warp, layout)
    textures = [steadied(skin, t, np.ones(len(t), bool))
                for t in _read_textures(clips, tracked, chosen, warp, progress)]
    seen = [luminance(t) for t in textures] if config.colour == "luminance" else textures
    rows, mean_texture, near = _gathered(tracked, chosen, seen, mean, config)
    colours = [t[n] for t, n in zip(textures, near, strict=True)] if config.colour == "luminance" else []
    del textures, seen
    modes = find_modes(rows, mean.size, config, supports(config.parts, layout, warp))
    bank = ColourBank.fit(colours, modes.parameters, config.clip_means) if colours else None
    limits = FrameLimits(stable_limit, shape_limit, robust_limit(modes.residuals, config.outlier, LEAST_TEXTURE),
                    robust_limit(modes.sizes, config.outlier, LEAST_PARAMETERS))
    return ActiveAppearanceModel(
        config, {g: (int(a), int(b)) for g, (a, b) in groups.items()}, reference, mean, warp, mean_texture,
        modes.shape.reshape(-1, *mean.shape), modes.texture.reshape(-1, *mean_texture.shape), modes.shape_weight,
        modes.deviations, spread, limits, bank)


def _track(clips: Sequence[Clip], layout: Layout, config: AAMConfig) -> tuple[PoseReference, list[_Shapes], float]:
    """Return the pose reference, every clip's shapes in its frame, and the limit of the stable points."""
    read = [clip.read_points(layout.needed) for clip in clips]
    if not any(valid.any() for _, valid in read):
        raise DnnvssError(f"none of the {len(clips)} training clips has a valid frame of landmarks",
                          remedy="Prepare the corpus again; its report says why frames were dropped")
    seen = np.concatenate([p[v][::config.texture_every, layout.stable] for p, v in read])
    rigid = config.alignment == "rigid"
    reference = PoseReference(mean_shape(seen, rigid=rigid), config.pose_smoothing, rigid)
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


def _choose(
    tracked: Sequence[_Shapes], usable: Sequence[int], pixels: int, config: AAMConfig
) -> dict[int, np.ndarray]:
    """Return clip number to the frames whose texture is read: every nth of randomly drawn clips until enough.

    Large textures are read from fewer frames, so that all of them together fit into memory.
    """
    enough = min(config.texture_frames, max(_MEMORY // (3 * 4 * pixels), 10 * int(max(config.modes, 10))))
    random = np.random.default_rng(config.seed)
    chosen: dict[int, np.ndarray] = {}
    count = 0
    for clip in random.permutation(usable):
        if count >= enough:
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
    import joblib  # slow to import, and synthesis needs none of it

    jobs = [joblib.delayed(_sample)(clips[i], tracked[i].points, frames, warp) for i, frames in chosen.items()]
    textures: list[np.ndarray] = []
    with counted(desc="reading textures", total=len(jobs), unit="clips", disable=not progress) as bar:
        for start in range(0, len(jobs), _BATCH):
            textures += joblib.Parallel()(jobs[start:start + _BATCH])
            bar.update(len(textures) - bar.n)
    return textures


def _sample(clip: Clip, points: np.ndarray, frames: np.ndarray, warp: Warp) -> np.ndarray:
    wanted = np.isin(np.arange(len(points)), frames)  # which rise
    pictures = zip(clip.pictures(len(points)), points, wanted, strict=True)
    return np.stack([warp.sample(picture, place) for picture, place, asked in pictures if asked])


def _gathered(
    tracked: Sequence[_Shapes], chosen: Mapping[int, np.ndarray], textures: Sequence[np.ndarray], mean: np.ndarray,
    config: AAMConfig,
) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Return rows (n, 2P + 3N) float32, shape then texture, of the frames that are not far out; the mean texture; and
    which frames of each clip these are.

    Each is centred on its clip's mean, or on the mean of all where the settings keep the clips' means.
    """
    distances = [texture_distance(t, np.median(t, axis=0)) for t in textures]
    limit = robust_limit(np.concatenate(distances), config.outlier, LEAST_TEXTURE)
    near = [d <= max(limit, d.min()) for d in distances]
    means = [t[n].mean(axis=0, dtype=np.float32) for t, n in zip(textures, near, strict=True)]
    mean_texture = np.stack(means).mean(axis=0)
    width = mean.size
    rows = np.empty((sum(int(n.sum()) for n in near), width + mean_texture.size), dtype=np.float32)
    start = 0
    for (clip, frames), texture, own, kept in zip(chosen.items(), textures, means, near, strict=True):
        part = rows[start:start + int(kept.sum())]
        shape_centre, texture_centre = (tracked[clip].mean, own) if config.clip_means else (mean, mean_texture)
        part[:, :width] = (tracked[clip].shapes[frames[kept]] - shape_centre).reshape(len(part), -1)
        part[:, width:] = (texture[kept] - texture_centre).reshape(len(part), -1)
        start += len(part)
    rows -= rows.mean(axis=0)  # the chosen frames' own mean is not exactly the clips'
    return rows, mean_texture, near
