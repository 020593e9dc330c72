"""Markers under wrong names: swapped with another, or elsewhere for a moment."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import linear_sum_assignment

_GATE, _GROWS, _MOST = 3.0, 0.12, 8.0
"""Millimetres from where a marker is expected beyond which it is doubted; by how much more for each frame since it was
seen; and the most."""
_LOOSE = 4.0
"""By how much faster the room grows in which a marker that is doubted may be, where no other is likelier."""
_FIRST = 12.0
"""The same where a marker was not seen yet: its place at rest is all that is known."""
_NEAR = 5
"""Neighbours whose movement tells that of a marker that is not seen."""
_LASTS = 3
"""Frames that a change of names lasts at least."""
_LOST = 0.1
"""Seconds after which a marker that is always elsewhere is believed."""


@dataclass(frozen=True)
class Renamed:
    """Markers under their right names.

    Args:
        points: (F, M, 3), NaN where missing or not believed.
        source: (F, M) the name under which each was found, its own number where it had its own; -1 where missing.
        thrown: (F, M) bool, samples that were no marker.
    """

    points: np.ndarray
    source: np.ndarray
    thrown: np.ndarray

    @property
    def swaps(self) -> list[tuple[int, int, int, int]]:
        """Marker, the name that it had, and the first and the end of the frames: each stretch under a wrong name."""
        count = self.source.shape[1]
        found = []
        for marker in range(count):
            wrong = np.where(
                (self.source[:, marker] >= 0) & (self.source[:, marker] != marker),
                self.source[:, marker],
                -1,
            )
            cuts = [0, *(np.flatnonzero(np.diff(wrong)) + 1).tolist(), len(wrong)]
            found += [(marker, int(wrong[a]), a, b) for a, b in pairwise(cuts) if wrong[a] >= 0]
        return found


def renamed(points: np.ndarray, rest: np.ndarray, rate: float) -> Renamed:
    """Markers of a take under their right names.

    Frame by frame a marker is expected where its speed leads it, and after a gap where its neighbours went. One that is
    farther from there than a gate changes names with others that are as well, or with missing ones, where these lie in
    their gates (the assignment of least squared distances); one that fits nowhere is thrown out.

    Args:
        points: (F, M, 3) mm without head motion, NaN where missing.
        rest: (M, 3) the usual place of each.
        rate: frames a second.
    """
    frames, count = points.shape[:2]
    near = _neighbours(rest)
    out, source = np.full_like(points, np.nan), np.full((frames, count), -1)
    last, speed, seen = rest.copy(), np.zeros_like(rest), np.full(count, -1)
    thrown, homeless = np.zeros((frames, count), bool), np.zeros(count, int)
    held = rest.copy()
    for f in range(frames):
        expected, gates = _expected(f, last, speed, seen, held, near)
        there = np.isfinite(points[f]).all(axis=1)
        names = _named(points[f], there, expected, gates)
        for marker in np.flatnonzero(there & ~np.isin(np.arange(count), names)):
            homeless[marker] += 1
            if (
                homeless[marker] > _LOST * rate and names[marker] < 0
            ):  # it is the expectation that is lost
                names[marker] = marker
            else:
                thrown[f, marker] = True
        found = names >= 0
        homeless[names[found]] = 0
        source[f], out[f, found] = names, points[f, names[found]]
        fresh = found & (seen == f - 1) & (f > 0)
        step = np.where(fresh[:, None], out[f] - last, 0.0)
        speed = np.where(found[:, None], 0.5 * speed + 0.5 * step if f else 0.0, speed)
        held = np.where(found[:, None], out[f], expected)
        last = np.where(found[:, None], out[f], last)
        seen = np.where(found, f, seen)
    return _lasting(Renamed(out, source, thrown))


def _lasting(found: Renamed) -> Renamed:
    """The same without swaps of a frame or two: a sample that was thrown near another marker's place."""
    for marker, name, first, end in found.swaps:
        if end - first < _LASTS:
            found.points[first:end, marker] = np.nan
            found.source[first:end, marker] = -1
            found.thrown[first:end, name] = True
    return found


def _neighbours(rest: np.ndarray) -> np.ndarray:
    far = np.linalg.norm(rest[:, None] - rest, axis=-1) + np.diag(np.full(len(rest), np.inf))
    return np.argsort(far, axis=1)[:, : min(_NEAR, len(rest) - 1)]


def _expected(
    f: int,
    last: np.ndarray,
    speed: np.ndarray,
    seen: np.ndarray,
    held: np.ndarray,
    near: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Where each marker (M, 3) is expected, and how far from there it may be (M,)."""
    gap = f - 1 - seen
    moving = last + speed
    carried = held + np.median(speed[near], axis=1) if near.size else held
    expected = np.where((gap <= 1)[:, None], moving, carried)
    gates = np.where(seen < 0, _FIRST, np.minimum(_GATE + _GROWS * np.maximum(gap, 0), _MOST))
    return expected, gates


def _named(
    points: np.ndarray, there: np.ndarray, expected: np.ndarray, gates: np.ndarray
) -> np.ndarray:
    """The name (M,) under which each marker is found, -1 where under none."""
    off = np.linalg.norm(points - expected, axis=1)
    names = np.where(there & (off <= gates), np.arange(len(points)), -1)
    odd = np.flatnonzero(there & (names < 0))
    if not len(odd):
        return names
    free = np.flatnonzero(names < 0)
    far = np.linalg.norm(points[odd][:, None] - expected[free], axis=-1)
    room = _GATE + _LOOSE * (gates[free] - _GATE)
    cost = np.where(far <= np.minimum(room, _FIRST), far**2, 1e6)
    rows, columns = linear_sum_assignment(cost)
    for row, column in zip(rows, columns, strict=True):
        if cost[row, column] < 1e6:
            names[free[column]] = odd[row]
    return names
