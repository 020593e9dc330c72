"""The lines of a face: smooth curves through its landmarks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

_STEPS = 8
"""Pieces of a curve from one landmark to the next."""
_JOINED = 2.0
"""Steps of usual length within which the end of a line is joined to its beginning."""
_BROKEN = 3.5
"""Steps of usual length beyond which a group is taken for two lines."""
_KINDS = ("lips", "mouth", "eye", "brow", "line")
"""In the order in which they are laid over each other, from the end."""


@dataclass(frozen=True)
class Stroke:
    """A line through landmarks.

    Args:
        kind: ``lips`` (their outer edge), ``mouth`` (the inner edge), ``eye``, ``brow`` or ``line``.
        rows: the landmarks that it runs through, in order.
        closed: whether it comes back to the first.
    """

    kind: str
    rows: np.ndarray
    closed: bool

    @cached_property
    def _weights(self) -> np.ndarray:
        """Weights (N, n) of a Catmull-Rom spline through n landmarks."""
        count = len(self.rows)
        spans = count if self.closed else count - 1
        t = np.arange(_STEPS) / _STEPS
        basis = 0.5 * np.stack([-t + 2 * t**2 - t**3, 2 - 5 * t**2 + 3 * t**3, t + 4 * t**2 - 3 * t**3, t**3 - t**2], 1)
        weights = np.zeros((spans * _STEPS + (not self.closed), count))
        for span in range(spans):
            for tap in range(4):
                at = span + tap - 1
                at = at % count if self.closed else min(max(at, 0), count - 1)
                weights[span * _STEPS : (span + 1) * _STEPS, at] += basis[:, tap]
        if not self.closed:
            weights[-1, -1] = 1.0
        return weights

    def curve(self, points: np.ndarray) -> np.ndarray:
        """The smooth line (N, 2) through landmarks (L, 2)."""
        return np.asarray(self._weights @ points[self.rows])


def strokes_of(groups: Mapping[str, Sequence[int]], rest: np.ndarray, outer: str, inner: str,
               eyes: Sequence[str]) -> list[Stroke]:
    """The lines of a face in the order in which they are drawn.

    Args:
        groups: landmark group to the half-open range of its rows.
        rest: landmarks (L, 2) at rest, which tell where groups are closed or broken.
        outer, inner: the groups round the lips.
        eyes: the groups round the eyes.
    """
    strokes = []
    for name, (start, stop) in groups.items():
        known = {outer: "lips", inner: "mouth"} | dict.fromkeys(eyes, "eye")
        kind = known.get(name, "eye" if "eye" in name and "brow" not in name else "brow" if "brow" in name else "line")
        lines = _lines(np.arange(start, stop), rest, kind in ("lips", "mouth"))
        strokes += [Stroke(kind, rows, closed) for rows, closed in (_joined(lines, rest) if kind == "brow" else lines)]
    return sorted(strokes, key=lambda s: _KINDS[::-1].index(s.kind) if s.kind != "mouth" else len(_KINDS))


def _lines(rows: np.ndarray, rest: np.ndarray, lips: bool) -> list[tuple[np.ndarray, bool]]:
    """The parts of a group that are one line each, and whether they are closed."""
    if len(rows) < 2 or lips:
        return [(rows, True)] if len(rows) > 2 else []
    steps = np.linalg.norm(np.diff(rest[rows], axis=0), axis=1)
    usual = max(float(np.median(steps)), 1e-9)
    parts = np.split(rows, np.flatnonzero(steps > _BROKEN * usual) + 1)
    gap = float(np.linalg.norm(rest[rows[0]] - rest[rows[-1]]))
    closed = len(parts) == 1 and len(rows) > 4 and gap <= _JOINED * usual
    return [(part, closed) for part in parts if len(part) > 1]


def _joined(lines: list[tuple[np.ndarray, bool]], rest: np.ndarray) -> list[tuple[np.ndarray, bool]]:
    """A brow whose two edges are lines of their own as one closed line."""
    if len(lines) != 2:
        return lines
    (upper, _), (lower, _) = lines
    ends = [float(np.linalg.norm(rest[upper[-1]] - rest[lower[i]])) for i in (0, -1)]
    return [(np.concatenate([upper, lower if ends[0] < ends[1] else lower[::-1]]), True)]
