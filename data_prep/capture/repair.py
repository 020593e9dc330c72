"""The repair of a take of markers, in two steps: names and head motion, then gaps and noise."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from data_prep.capture.gaps import filled
from data_prep.capture.head import find_head
from data_prep.capture.kalman import noise_of, smoothed
from data_prep.capture.learnt import Usual
from data_prep.capture.names import renamed


@dataclass(frozen=True)
class Repaired:
    """Markers of a take, repaired so far.

    Args:
        points: (F, M, 3) mm in the frame of the head; NaN where missing.
        told: plain containers: each stretch that was repaired, and what was measured.
    """

    points: np.ndarray
    told: dict[str, Any]


def settled(
    seen: np.ndarray,
    jig_seen: np.ndarray,
    jig: np.ndarray,
    rest: np.ndarray | None,
    rate: float,
    names: tuple[str, ...],
) -> Repaired:
    """A take without head motion, its markers under their right names.

    Args:
        seen, jig_seen: (F, M, 3) the markers of the face and (F, J, 3) of the jig, mm, NaN where missing.
        jig: (J, 3) the rigid jig.
        rest: (M, 3) the usual places of the markers; their medians in this take where None.
        rate: frames a second.
        names: of the markers.

    Raises:
        DnnvssError: the jig is hardly seen.
    """
    pose = find_head(jig_seen, jig, rate)
    still = pose.taken_out(seen)
    if rest is None:
        rest = usual_places(still)
    found = renamed(still, rest, rate)
    degrees, far = pose.movement
    told = {
        "head_degrees": round(degrees, 2),
        "head_mm": round(far, 1),
        "jig_mm": round(float(np.sqrt(np.nanmean(pose.left**2))), 3),
        "swaps": [[names[a], names[b], first, end] for a, b, first, end in found.swaps],
        "flickers": [[names[m], int(f)] for f, m in np.argwhere(found.thrown)],
    }
    return Repaired(found.points, told)


def usual_places(still: np.ndarray) -> np.ndarray:
    """The median (M, 3) of each marker in takes (F, M, 3); far away from all where it is never seen."""
    never = ~np.isfinite(still).all(axis=2).any(axis=0)
    rest = np.nanmedian(np.where(never[:, None], 0.0, still), axis=0)
    return np.where(never[:, None], 1e6, rest)


def whole(points: np.ndarray, usual: Usual, rate: float, names: tuple[str, ...]) -> Repaired:
    """A settled take without gaps and noise.

    In a gap stands what the other markers tell of a marker, and what they do not tell of it beside the gap, resampled
    in the cosine domain; then each coordinate is smoothed forward and backward.

    Args:
        points: (F, M, 3), NaN where missing.
        usual: how the markers move together.
        rate: frames a second.
        names: of the markers.
    """
    rows = points.reshape(len(points), -1)
    known = np.isfinite(rows)
    common = usual.told(rows, known)
    left = filled(np.where(known, rows - common, 0.0), known)
    left[:, ~known.any(axis=0)] = 0.0
    full = np.where(known, rows, common + left)
    clean = smoothed(full, rate)
    missing = ~np.isfinite(points).all(axis=2)
    told = {
        "missing": round(float(missing.mean()), 4),
        "noise_mm": round(float(np.median(noise_of(full))), 3),
        "gaps": [
            [name, first, end]
            for name, column in zip(names, missing.T, strict=True)
            for first, end in stretches(column)
        ],
    }
    return Repaired(clean.reshape(points.shape), told)


def stretches(mask: np.ndarray) -> list[tuple[int, int]]:
    """First and end of each run of True in a mask (F,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
