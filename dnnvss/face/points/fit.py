"""Fitting a face of points to the clips of a training split."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.clips import Clip
from dnnvss.face.outliers import LEAST_PARAMETERS, LEAST_SHAPE, LEAST_STABLE, shape_distance, spread_of
from dnnvss.face.pca import components
from dnnvss.face.point_set import Layout
from dnnvss.face.points.model import PointLimits, PointsFace
from dnnvss.face.points.pose import Reference, learn_reference, taken_out
from dnnvss.face.points.settings import PointsSettings
from dnnvss.robust import robust_limit

_EVERY = 5
"""One frame in this many of a clip tells the reference frame."""
_MOST = 100_000
"""Frames that the modes are learnt from."""
_RIDGE = 1e-6
"""Weight of the ridge that ties landmarks which are not modelled to the parameters, over the parameters' variance."""
_STILL = 1e-3
"""Share of the largest standard deviation that each parameter is taken to have at least."""


@dataclass(frozen=True)
class _Clip:
    """All landmarks (F, L, 2 or 3) of a clip in the reference frame, and the frames (F,) that are kept."""

    whole: np.ndarray
    keep: np.ndarray

    def centred(self, mean: np.ndarray | None) -> np.ndarray:
        """The kept frames less a mean shape (L, 2 or 3); less their own where there is none."""
        kept = self.whole[self.keep]
        return kept - (kept.mean(axis=0) if mean is None else mean)


def fit_points(
    clips: Sequence[Clip],
    groups: Mapping[str, tuple[int, int]],
    settings: PointsSettings | None = None,
    *,
    progress: bool = True,
) -> PointsFace:
    """The face fitted to clips. Frames that are not valid, or far out by a robust rule, take no part.

    Args:
        clips: the training clips.
        groups: the corpus's landmark groups.
        settings: the defaults where None.
        progress: not used: points are read in a moment.

    Raises:
        DnnvssError: no usable frame, clips of different dimensions, points that do not move, or a point set that does
            not fit the corpus.
    """
    settings = settings or PointsSettings()
    settings = replace(settings, points=settings.points.fitted(groups))
    layout = settings.points.layout(groups)
    read = _read(clips, layout)
    reference = _reference(read, layout, settings)
    found, stable = _still(clips, read, reference, layout, settings)
    found, spread, shape = _near(found, layout, settings)
    usable = [c for c in found if c.keep.any()]
    mean = np.mean([c.whole[c.keep].mean(axis=0) for c in usable], axis=0)
    rows = np.concatenate([c.centred(None if settings.clip_means else mean) for c in usable])
    rows = rows[:: -(-len(rows) // _MOST)]
    rows = rows - rows.mean(axis=0)
    modes = _modes(rows[:, layout.rows], settings)
    parameters = rows[:, layout.rows].reshape(len(rows), -1) @ modes.reshape(len(modes), -1).T
    deviations = parameters.std(axis=0)
    deviations = np.maximum(deviations, _STILL * deviations.max())
    sizes = np.sqrt(((parameters / deviations) ** 2).mean(axis=1))
    whole = _tied(rows, parameters)
    whole[:, layout.rows] = modes
    limits = PointLimits(stable, shape, robust_limit(sizes, settings.outlier, LEAST_PARAMETERS))
    return PointsFace(settings, {g: (int(a), int(b)) for g, (a, b) in groups.items()}, reference, mean[layout.rows],
                      modes, deviations, spread, limits, mean, whole)


def _read(clips: Sequence[Clip], layout: Layout) -> list[tuple[np.ndarray, np.ndarray]]:
    read = [clip.read_points(layout.needed, (2, 3)) for clip in clips]
    if not any(valid.any() for _, valid in read):
        raise DnnvssError(f"none of the {len(clips)} training clips has a valid frame of landmarks",
                          remedy="Prepare the corpus again; its report says why frames were dropped")
    for clip, (points, _) in zip(clips, read, strict=True):
        if points.shape[1:] != read[0][0].shape[1:]:
            raise DnnvssError(f"has landmarks {points.shape[1:]}, utterance {clips[0].id} has {read[0][0].shape[1:]}",
                              utterance=clip.id, remedy="Prepare the corpus again")
    return read


def _reference(read: Sequence[tuple[np.ndarray, np.ndarray]], layout: Layout, settings: PointsSettings) -> Reference:
    seen = np.concatenate([points[valid][::_EVERY] for points, valid in read])
    outer = layout.rows[layout.outer]
    lips = np.median(seen[:, outer], axis=0)
    far = np.linalg.norm(lips[:, None] - lips, axis=-1)  # the corners, however the tracker's axes lie
    pair = sorted(np.unravel_index(far.argmax(), far.shape), key=lambda i: lips[i, 0])
    return learn_reference(seen, layout.stable, (int(outer[pair[0]]), int(outer[pair[1]])), settings.pose_smoothing)


def _still(clips: Sequence[Clip], read: Sequence[tuple[np.ndarray, np.ndarray]], reference: Reference,
           layout: Layout, settings: PointsSettings) -> tuple[list[_Clip], float]:
    """Every clip without head pose, and the limit of the stable points."""
    residuals = [reference.residual(points[:, layout.stable]) for points, _ in read]
    measured = np.concatenate([r[valid] for r, (_, valid) in zip(residuals, read, strict=True)])
    limit = robust_limit(measured, settings.outlier, LEAST_STABLE)
    found = []
    for clip, (points, valid), residual in zip(clips, read, residuals, strict=True):
        keep = valid & (residual <= limit)
        pose = reference.poses(points[:, layout.stable], keep, clip.rate)
        found.append(_Clip(taken_out(points, pose, reference), keep))
    return found, limit


def _near(found: Sequence[_Clip], layout: Layout, settings: PointsSettings) -> tuple[list[_Clip], np.ndarray, float]:
    """The clips without frames that are far out, each coordinate's robust spread, and the limit of the distance."""
    centres = [np.median(c.whole[c.keep][:, layout.rows], axis=0) if c.keep.any() else None for c in found]
    centred = np.concatenate([c.whole[c.keep][:, layout.rows] - m for c, m in zip(found, centres, strict=True)
                              if m is not None])
    spread = spread_of(centred)
    limit = robust_limit(shape_distance(centred, np.zeros_like(spread), spread), settings.outlier, LEAST_SHAPE)
    near = [c if m is None else _Clip(c.whole, c.keep & (shape_distance(c.whole[:, layout.rows], m, spread) <= limit))
            for c, m in zip(found, centres, strict=True)]
    return near, spread, limit


def _modes(rows: np.ndarray, settings: PointsSettings) -> np.ndarray:
    """Orthonormal modes (D, P, 2 or 3) of centred shapes (n, P, 2 or 3)."""
    flat = rows.reshape(len(rows), -1)
    modes = np.eye(flat.shape[1]) if settings.modes == "raw" else components(flat, settings.modes, settings.seed).modes
    if not len(modes) or not np.ptp(flat):
        raise DnnvssError(f"the face has nothing to learn: the points of {len(rows)} frames do not move",
                          remedy="Give more clips or longer ones")
    return modes.reshape(-1, *rows.shape[1:])


def _tied(rows: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    """How all landmarks (n, L, 2 or 3) move with parameters (n, D), least squares: (D, L, 2 or 3)."""
    squares = parameters.T @ parameters
    squares += _RIDGE * np.trace(squares) / len(squares) * np.eye(len(squares))
    flat = np.linalg.solve(squares, parameters.T @ rows.reshape(len(rows), -1))
    return flat.reshape(-1, *rows.shape[1:])
