"""The control points of a head: its curves and places between them, and the triangles that they span."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from dnnvss.face.mesh.head import Head, packaged_head

_EVERY = dict.fromkeys(
    ("lips_outer", "lips_inner", "right_eye", "left_eye", "right_lid", "left_lid"), 2
)
"""Of the vertices of a ring, every second is a control point."""
_HOLES = ("lips_inner", "right_eye", "left_eye")
"""Rings that the surface ends at."""
_MORE, _BEHIND = 170, -0.03
"""Control points between the curves, and metres behind the head's middle at which the surface ends."""
_AROUND, _DENSER = 0.03, 2.2
"""Metres round eyes and mouth in which control points lie closer to each other, and how much closer."""
_BESIDE, _BEFORE = 0.08, 0.006
"""Angle within which another place lies before one, and metres by which."""
_CENTRE = np.array([0.0, -0.03, 0.0])
"""From where the head is unrolled, metres."""
_OPENED = 0.7
"""Jaw of the pose in which control points are joined: with the lips apart, none is joined across them."""


@dataclass(frozen=True)
class Net:
    """Control points on a head.

    Args:
        names: of the points (P,), a curve and a number each, or ``skin`` and a number.
        vertices: of the head (P,).
        triangles: corners (T, 3) among the points.
    """

    names: tuple[str, ...]
    vertices: np.ndarray
    triangles: np.ndarray

    def at(self, vertices: np.ndarray) -> np.ndarray:
        """The points (..., P, 3) on vertices (..., V, 3) of the head."""
        return np.asarray(vertices[..., self.vertices, :])


@cache
def packaged_net() -> Net:
    """The control points of the packaged head."""
    head = packaged_head()
    named = {
        f"{curve}{k + 1:02d}": int(v)
        for curve, ring in head.curves.items()
        for k, v in enumerate(ring)
        if k % _EVERY.get(curve, 1) == 0
    }
    names = list(dict.fromkeys(named[name] for name in named))
    first = {v: name for name, v in reversed(named.items())}
    spread = _spread(head, names)
    rows = np.array(names + spread)
    labels = [first[v] for v in names] + [f"skin{k + 1:03d}" for k in range(len(spread))]
    return Net(tuple(labels), rows, _joined(head, rows, labels))


def _spread(head: Head, taken: list[int]) -> list[int]:
    """Vertices of the skin, each as far as can be from those that are taken."""
    v = head.mesh.vertices
    skin = np.setdiff1d(
        head.mesh.of_part("skin"),
        np.concatenate([head.mesh.of_part(p) for p in ("mouth", "socket")]),
    )
    outward = (head.mesh.normals()[skin] * (v[skin] - _CENTRE)).sum(axis=1) > 0
    skin = skin[outward & (v[skin, 2] > _BEHIND) & (np.abs(v[skin, 0]) < 0.072)]
    skin = skin[~_covered(v[skin] - _CENTRE)]
    away = np.sqrt(((v[skin][:, None] - v[taken]) ** 2).sum(axis=2)).min(axis=1)
    centres = np.array([v[head.curves[name]].mean(axis=0) for name in _HOLES])
    from_holes = np.sqrt(((v[skin][:, None] - centres) ** 2).sum(axis=2)).min(axis=1)
    dense = np.where(from_holes < _AROUND, _DENSER, 1.0)
    found: list[int] = []
    for _ in range(_MORE):
        best = int((away * dense).argmax())
        found.append(int(skin[best]))
        away = np.minimum(away, np.sqrt(((v[skin] - v[skin[best]]) ** 2).sum(axis=1)))
    return found


def _covered(away: np.ndarray) -> np.ndarray:
    """Whether others lie before places (n, 3), seen from the outside."""
    radius = np.sqrt((away**2).sum(axis=1))
    beside = cKDTree(away / radius[:, None]).query_ball_point(away / radius[:, None], _BESIDE)
    return np.array(
        [radius[others].max() > own + _BEFORE for own, others in zip(radius, beside, strict=True)]
    )


def _joined(head: Head, rows: np.ndarray, labels: list[str]) -> np.ndarray:
    """Triangles of the points on the unrolled head, with its mouth open and without its holes."""
    weights = np.zeros(len(head.names))
    weights[head.position("jawOpen")] = _OPENED
    away = head.vertices(weights)[rows] - _CENTRE
    flat = np.stack(
        [
            np.arctan2(away[:, 0], away[:, 2]),
            np.arctan2(away[:, 1], np.hypot(away[:, 0], away[:, 2])),
        ],
        axis=1,
    )
    triangles = Delaunay(flat).simplices
    for hole in _HOLES:
        ring = np.array([label.startswith(hole) for label in labels])
        triangles = triangles[~ring[triangles].all(axis=1)]
    still = head.mesh.vertices[rows]
    a, b, c = (still[triangles[:, k]] for k in range(3))
    inward = (np.cross(b - a, c - a) * ((a + b + c) / 3 - _CENTRE)).sum(axis=1) < 0
    triangles[inward] = triangles[inward][:, [0, 2, 1]]
    return np.asarray(triangles)
