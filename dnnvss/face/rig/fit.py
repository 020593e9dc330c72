"""A rig from the takes of a training split, and takes as its curves."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.face.clips import Clip, UnusableClipError
from dnnvss.face.report import between_share
from dnnvss.face.rig.code import RigCode
from dnnvss.face.rig.model import RigFace
from dnnvss.face.rig.settings import RigSettings
from dnnvss.timing import bridged, fill_invalid

_STILL = 1e-3
"""Share of the largest standard deviation that each parameter is taken to have at least."""


def fit_rig(
    clips: Sequence[Clip],
    groups: Mapping[str, tuple[int, int]],
    settings: RigSettings | None = None,
    *,
    progress: bool = True,
) -> RigFace:
    """The rig whose curves are the groups of a corpus, each with one value a frame.

    Args:
        clips: the training takes.
        groups: name of each curve to its row.
        settings: the defaults where None.
        progress: not used: curves are read in a moment.

    Raises:
        DnnvssError: groups of points instead of curves, a range of an unknown curve, no usable
            frame, or no curve that moves.
    """
    del progress
    settings = settings or RigSettings()
    names = _names(groups)
    if unknown := [name for name in settings.ranges if name not in names]:
        raise DnnvssError(
            f"face.ranges names {unknown[0]!r}, which is no curve of the corpus",
            remedy=f"Its curves are {', '.join(names[:8])}, ...",
        )
    read = [clip.read_points(len(names), (1,)) for clip in clips]
    rows = np.concatenate([points[valid, : len(names), 0] for points, valid in read])
    if not len(rows):
        raise DnnvssError(
            f"none of the {len(clips)} training takes has a valid frame",
            remedy="Prepare the corpus again; its report says why frames were dropped",
        )
    ranges = _ranges(rows, names, settings)
    moving = np.ptp(rows, axis=0) > settings.still * np.ptp(ranges, axis=1)
    if not moving.any():
        raise DnnvssError(
            f"none of the {len(names)} curves moves in {len(rows)} training frames",
            remedy="Give more takes or longer ones",
        )
    rest = np.where(moving, np.clip(0.0, *ranges.T), np.median(rows, axis=0))
    deviations = rows[:, moving].std(axis=0)
    return RigFace(
        settings, names, moving, rest, ranges, np.maximum(deviations, _STILL * deviations.max())
    )


def _names(groups: Mapping[str, tuple[int, int]]) -> tuple[str, ...]:
    """The names of curves, in the order of their rows."""
    rows = {first: name for name, (first, end) in groups.items() if end == first + 1}
    if len(rows) < len(groups) or sorted(rows) != list(range(len(rows))):
        raise DnnvssError(
            "the corpus holds points, and not one value for each named curve",
            remedy="Use face=points or face=aam, or prepare curves: corpus=motion",
        )
    return tuple(rows[i] for i in range(len(rows)))


def _ranges(rows: np.ndarray, names: Sequence[str], settings: RigSettings) -> np.ndarray:
    """The least and greatest value (C, 2) of each curve."""
    low, high = rows.min(axis=0), rows.max(axis=0)
    usual = (low >= 0) & (high <= 1)
    found = np.stack(
        [np.where(usual, 0.0, low), np.where(usual, 1.0, np.maximum(high, low + 1e-6))], 1
    )
    for name, ends in settings.ranges.items():
        found[names.index(name)] = ends
    return np.asarray(found)


def encode_rig(face: RigFace, clip: Clip) -> RigCode:
    """The code of a take: the values of the moving curves as they are.

    Raises:
        UnusableClipError: no frame is usable.
        DnnvssError: another number of curves than the rig's.
    """
    points, valid = clip.read_points(len(face.all_curves), (1,))
    if points.shape[1] != len(face.all_curves):
        raise DnnvssError(
            f"has {points.shape[1]} curves, the rig has {len(face.all_curves)}",
            utterance=clip.id,
            remedy="Export the curves of the corpus's own rig",
        )
    if not valid.any():
        raise UnusableClipError(
            "no frame has usable curves", utterance=clip.id, remedy="Drop the take from the corpus"
        )
    parameters = fill_invalid(points[:, face.moving, 0], valid).astype(np.float32)
    return RigCode(parameters, valid | bridged(valid, clip.rate))


def stabilise(face: RigFace, points: np.ndarray, code: RigCode) -> np.ndarray:
    """The points (F, 0, 2) of a take: a rig has none."""
    del code
    return face.points(np.zeros((len(points), len(face.names))))


def build_report(
    face: RigFace,
    corpus: Corpus,
    splits: Mapping[str, Sequence[str]],
    codes: Path,
    kept: Sequence[str],
) -> dict[str, Any]:
    """Plain containers that say which curves move, between which values, and where they stand.

    ``beyond``: for each split the share of values that lie outside the curves' ranges.
    ``between_takes``: for each curve the share of its training variance that lies between takes.
    """
    del corpus
    read = {i: RigCode.load(codes / f"{i}.npz") for i in kept}
    low, high = face.ranges.T

    def beyond(ids: Sequence[str]) -> float:
        rows = np.concatenate(
            [read[i].parameters for i in ids if i in read] or [np.zeros((0, len(low)))]
        )
        return (
            round(float(((rows < low - 1e-6) | (rows > high + 1e-6)).mean()), 6)
            if len(rows)
            else 0.0
        )

    train = [read[i].parameters[read[i].valid] for i in splits["train"] if i in read]
    shares = between_share([rows for rows in train if len(rows)])
    return {
        "curves": len(face.all_curves),
        "moving": list(face.names),
        "ranges": {
            n: [round(float(v), 6) for v in r] for n, r in zip(face.names, face.ranges, strict=True)
        },
        "beyond": {name: beyond(ids) for name, ids in splits.items()},
        "between_takes": dict(zip(face.names, shares.round(4).tolist(), strict=True)),
    }
