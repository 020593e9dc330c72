"""Where the points of a face lie on a head: by the names of their groups and their place along the contour."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.mesh.head import Head

OTHER_NAMES = {"jaw": "face_oval", "lips": "lips_outer"}
"""Groups of other markups by the name of the head's curve."""
_LIPS, _RINGS = ("lips_outer", "lips_inner"), ("right_eye", "left_eye")
_FINE = 16


@dataclass(frozen=True)
class Places:
    """Points on edges of a mesh, each between two vertices.

    Args:
        names: of the points (P,), a group and a number each.
        first, second: vertices (P,).
        share: how far each point (P,) lies from the first to the second.
    """

    names: tuple[str, ...]
    first: np.ndarray
    second: np.ndarray
    share: np.ndarray

    def at(self, vertices: np.ndarray) -> np.ndarray:
        """Positions (..., P, 3) on vertices (..., V, 3)."""
        near, far = vertices[..., self.first, :], vertices[..., self.second, :]
        return near + self.share[:, None] * (far - near)

    def __len__(self) -> int:
        return len(self.names)


def at_vertices(names: Sequence[str], vertices: Sequence[int]) -> Places:
    """Places at vertices themselves."""
    rows = np.asarray(vertices, int)
    return Places(tuple(names), rows, rows, np.zeros(len(rows)))


def match_contours(
    head: Head, contours: Mapping[str, Sequence[int]], neutral: np.ndarray
) -> tuple[Places, np.ndarray]:
    """The places on a head of a face's points, and which of the points they are (n,).

    Points of a lip keep their share of the mouth's width, on the upper or lower side; points of the jaw their direction
    from the middle of the mouth, points round an eye that from its middle, points of a line their share of its length.

    Args:
        head: whose curves are known.
        contours: group to its points among P; groups that the head has no curve for are left.
        neutral: the points (P, 2 or 3) at rest, x to the viewer's right and y up.

    Raises:
        DnnvssError: the face has no contour of the lips.
    """
    groups = {OTHER_NAMES.get(name, name): np.asarray(rows, int) for name, rows in contours.items()}
    if _LIPS[0] not in groups:
        raise DnnvssError(
            f"none of the groups {', '.join(contours)} runs round the lips (lips_outer)",
            remedy="Name the groups of the markup as conf/aam and docs/face.md do",
        )
    middle = neutral[groups[_LIPS[0]], :2].mean(axis=0)
    on_head = head.mesh.vertices[head.curves[_LIPS[0]], :2].mean(axis=0)
    names, rows, parts = [], [], []
    for name, mine in groups.items():
        if name not in head.curves:
            continue
        curve, points = head.curves[name], neutral[mine, :2]
        fine = _Fine(curve, head.mesh.vertices, closed=name in (*_LIPS, *_RINGS))
        if name in _LIPS:
            parts.append(_by_width(fine, points))
        elif name == "face_oval" or name in _RINGS:
            centres = (
                (middle, on_head)
                if name == "face_oval"
                else (points.mean(axis=0), fine.points.mean(axis=0))
            )
            parts.append(
                fine.taken(_turned(points - centres[0], fine.points - centres[1]).argmin(axis=1))
            )
        else:
            parts.append(_by_length(fine, points))
        names += [f"{name}{k + 1:02d}" for k in range(len(mine))]
        rows.append(mine)
    first, second, share = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Places(tuple(names), first, second, share), np.concatenate(rows)


class _Fine:
    """A curve through vertices at small steps: the two vertices, the share, and the point seen from the front."""

    def __init__(self, curve: np.ndarray, vertices: np.ndarray, closed: bool) -> None:
        ends = np.roll(curve, -1) if closed else curve[1:]
        starts = curve if closed else curve[:-1]
        self.first, self.second = np.repeat(starts, _FINE), np.repeat(ends, _FINE)
        self.share = np.tile(np.arange(_FINE) / _FINE, len(starts))
        if not closed:
            self.first, self.second = (
                np.append(self.first, curve[-1]),
                np.append(self.second, curve[-1]),
            )
            self.share = np.append(self.share, 0.0)
        near, far = vertices[self.first], vertices[self.second]
        self.whole = near + self.share[:, None] * (far - near)
        self.points = self.whole[:, :2]

    def taken(self, at: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Two vertices and the share of the way between them, at some steps (n,)."""
        return self.first[at], self.second[at], self.share[at]


def _by_width(fine: _Fine, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Steps of a lip's ring at the share of the width of each point (n, 2), on the same lip."""
    wrong = _sides(points)[:, None] * _sides(fine.points) < 0
    away = np.abs(_across(points)[:, None] - _across(fine.points))
    return fine.taken((away + 10 * wrong).argmin(axis=1))


def _across(ring: np.ndarray) -> np.ndarray:
    """Share of the way (n,) from the left-most to the right-most point."""
    low, high = ring[ring[:, 0].argmin()], ring[ring[:, 0].argmax()]
    along = high - low
    return np.asarray((ring - low) @ along / max(along @ along, 1e-12))


def _sides(ring: np.ndarray) -> np.ndarray:
    """1 for points (n,) of the upper lip, -1 for those of the lower, 0 for the corners: by their order in the ring."""
    first, last = sorted((int(ring[:, 0].argmin()), int(ring[:, 0].argmax())))
    at = np.arange(len(ring))
    between = (at > first) & (at < last)
    around = (at < first) | (at > last)
    means = [ring[part, 1].mean() if part.any() else -np.inf for part in (between, around)]
    return np.where(between, 1, 0) * (1 if means[0] >= means[1] else -1) + np.where(
        around, 1, 0
    ) * (1 if means[1] > means[0] else -1)


def _turned(mine: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """How far directions (n, 2) and (m, 2) are turned from each other, (n, m)."""
    first, second = (d / np.maximum(np.hypot(d[:, :1], d[:, 1:]), 1e-12) for d in (mine, theirs))
    return 1 - first @ second.T


def _by_length(fine: _Fine, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Steps of a line at the share of its length of each point (n, 2), in the order of the points."""
    mine, theirs = _lengths(points), _lengths(fine.whole)
    return fine.taken(np.abs(mine[:, None] - theirs).argmin(axis=1))


def _lengths(line: np.ndarray) -> np.ndarray:
    steps = np.sqrt((np.diff(line, axis=0) ** 2).sum(axis=1))
    along = np.concatenate([[0.0], np.cumsum(steps)])
    return along / max(along[-1], 1e-12)
