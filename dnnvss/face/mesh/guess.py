"""The control points of the packaged head guessed on another mesh, by the shapes of the two at rest.

The head is laid onto the mesh by a similarity, tried in each of the ways in which a mesh may stand on
its axes, and is then bent: places on it go to the nearest of the mesh, near in space and in the
direction of the surface, and a smooth warp takes it there, stiff at first and softer in each round.
What comes of it is checked: a mesh that is no face is refused.

**Source.** P. J. Besl, N. D. McKay, "A method for registration of 3-D shapes", IEEE PAMI 14(2), 1992,
for the similarity; the rounds of a stiff warp over nearest places are in the manner of B. Amberg,
S. Romdhani, T. Vetter, "Optimal step nonrigid ICP algorithms for surface registration", CVPR 2007.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from itertools import permutations, product

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

from dnnvss.errors import DnnvssError
from dnnvss.face.mesh.deformer import LOOSE
from dnnvss.face.mesh.head import packaged_head
from dnnvss.face.mesh.net import packaged_net
from dnnvss.face.mesh.surface import Mesh

REMEDY = (
    "Set its points in the browser: dnnvss points MESH --out FOLDER --page; or name some: --points "
    'FILE.json with {"nose_bridge07": 123, "lips_outer01": [x, y, z], ...}'
)
_ROUNDS, _KEPT, _FACING = 40, 0.7, 0.5
"""Rounds of the search for the head in a mesh, the share of points that count, how alike normals are."""
_FAR, _FITS, _MASK, _SURE = 0.03, 0.62, 0.7, 0.75
"""Share of the head's height by which a point may miss the mesh, the share of points that may not, that of a mask's
(eggs and animals have .65 of them), and that of which no other way to stand is tried."""
_STIFF = (10.0,) * 4 + (3.0,) * 4 + (1.0,) * 6
"""How stiff the warp is in each of its rounds."""
_STOOD = 2e-4
"""Metres of the head by which a round of the search still moves it."""
_TURNED = 0.01
"""Share of the head's size that counts as much as a surface turned by a radian."""
_REACH, _BEHIND, _PLACES = 0.06, -0.03, 600
"""Share of the head's size in which a place is looked for; metres behind the head's middle, and how many places."""
_CREASED = 2.0
"""How much larger or smaller than usual a triangle between control points may be, on average."""


@dataclass(frozen=True)
class _Target:
    """What is looked for in a mesh: its outside, with normals, and its eyes where they are known."""

    vertices: np.ndarray
    normals: np.ndarray
    eyes: np.ndarray

    @classmethod
    def of(cls, mesh: Mesh) -> "_Target":
        inside = np.concatenate([mesh.of_part(p) for p in LOOSE]).astype(int)
        rows = np.setdiff1d(np.unique(mesh.faces), inside)
        return cls(mesh.vertices[rows], mesh.normals()[rows], eye_places(mesh))


@dataclass(frozen=True)
class _Similarity:
    """A turn, a size and two middles; the share of points that it brings near the mesh, and whether that is enough."""

    turn: np.ndarray
    size: float
    origin: np.ndarray
    end: np.ndarray
    share: float = 0.0
    fits: bool = False

    def __call__(self, points: np.ndarray) -> np.ndarray:
        return (points - self.origin) @ self.turn.T * self.size + self.end


@cache
def turns() -> np.ndarray:
    """The turns (24, 3, 3) that take axes to axes, that which leaves them first."""
    made = []
    for order, signs in product(permutations(range(3)), product((1, -1), repeat=3)):
        turn = np.zeros((3, 3))
        turn[range(3), order] = signs
        if np.linalg.det(turn) > 0:
            made.append(turn)
    return np.array(made)


def upright(points: np.ndarray) -> np.ndarray:
    """The turn (3, 3), of :func:`turns`, that brings control points (P, 3) of a mesh upright, looking along z."""
    net, head = packaged_net(), packaged_head()
    return _snapped(_similarity(net.at(head.mesh.vertices), points).turn)


def _snapped(turn: np.ndarray) -> np.ndarray:
    """The turn of axes that undoes another (3, 3) best."""
    return np.asarray(turns()[np.einsum("nij,ji->n", turns(), turn).argmax()])


def guess_points(mesh: Mesh) -> np.ndarray:
    """Where the control points of the packaged head lie in a mesh (P, 3), whichever way it stands.

    Raises:
        DnnvssError: no head is found in it.
    """
    best, found = best_turn(mesh)
    if not found.fits:
        raise DnnvssError(
            f"the head fits this mesh at {found.share:.0%} of its points", remedy=REMEDY
        )
    target = _Target.of(turned(mesh, best))
    straight = _Similarity(best @ found.turn, found.size, found.origin, best @ found.end)
    points = _bent(target, straight)(packaged_net().at(packaged_head().mesh.vertices))
    return _checked(target, points) @ best


def turned(mesh: Mesh, turn: np.ndarray) -> Mesh:
    """A mesh turned (3, 3); itself where the turn leaves all axes."""
    if (turn == np.eye(3)).all():
        return mesh
    return replace(mesh, vertices=mesh.vertices @ turn.T)


def best_turn(mesh: Mesh) -> tuple[np.ndarray, "_Similarity"]:
    """The turn (3, 3) that brings a mesh upright where it is a head, and how the packaged head is laid onto it.

    A mesh in which no head is found is left as it stands.
    """
    target, net, whole = _Target.of(mesh), packaged_net(), packaged_head().mesh.vertices
    best = _best(target, whole, np.arange(len(net.names)), _FITS)
    if not best.fits:
        face = np.array([k for k, name in enumerate(net.names) if not name.startswith("skin")])
        mask = _best(target, net.at(whole)[face], face, _MASK)
        best = mask if mask.fits or mask.share > best.share else best
    return (_snapped(best.turn) if best.fits else np.eye(3)), best


def _best(target: _Target, extent: np.ndarray, points: np.ndarray, enough: float) -> _Similarity:
    """The best that :func:`_laid` finds from any turn; it fits where its share is ``enough``."""
    best = _laid(target, turns()[0], extent, points)
    for turn in turns()[1:]:
        if best.share > _SURE:
            break
        best = max(best, _laid(target, turn, extent, points), key=lambda found: found.share)
    return replace(best, fits=best.share >= enough)


def _laid(target: _Target, turn: np.ndarray, extent: np.ndarray, points: np.ndarray) -> _Similarity:
    """The head laid onto a mesh by a similarity, from a turn on; its share is 0 where it finds nothing near.

    Args:
        target: what it is laid onto.
        turn: (3, 3).
        extent: places (n, 3) of the head that the mesh reaches to: all of it, or those of a mask.
        points: the control points (m,) that the mesh has.
    """
    net, head = packaged_net(), packaged_head()
    rows = net.vertices[points]
    source, normals = head.mesh.vertices[rows], head.mesh.normals()[rows]
    whole = extent @ turn.T
    up = int(np.abs(turn[:, 1]).argmax())
    size = float(np.ptp(target.vertices[:, up]) / np.ptp(whole[:, up])) or 1.0
    ends = [(v.min(axis=0) + v.max(axis=0)) / 2 for v in (target.vertices, whole)]
    found = _Similarity(turn, size, ends[1] @ turn, ends[0])
    tree, each = cKDTree(target.vertices), np.arange(len(source))
    for _ in range(_ROUNDS):
        placed = found(source)
        away, nearest = tree.query(placed, k=min(8, len(target.vertices)))
        facing = target.normals[nearest]
        fits = np.einsum("pkd,pd->pk", facing, normals @ found.turn.T) > _FACING
        best = fits.argmax(axis=1)
        distance = np.where(fits.any(axis=1), away[each, best], np.inf)
        order = np.argsort(distance)[: round(_KEPT * len(distance))]
        counted = order[np.isfinite(distance[order])]
        if len(counted) < _KEPT * len(order):
            return found
        goal = target.vertices[nearest[each, best]]
        found = _similarity(source[counted], goal[counted])
        if np.abs(found(source) - placed).max() < _STOOD * found.size:
            break
    close = np.sqrt(((found(source) - goal) ** 2).sum(axis=1)) < _FAR * found.size * _height()
    share = float((np.isfinite(distance) & close).mean())
    return _Similarity(found.turn, found.size, found.origin, found.end, share)


def _height() -> float:
    """Metres from the lowest to the highest control point of the packaged head."""
    return float(np.ptp(packaged_net().at(packaged_head().mesh.vertices)[:, 1]))


def _bent(target: _Target, start: _Similarity) -> Callable[[np.ndarray], np.ndarray]:
    """The warp of the head's space onto a mesh."""
    source, normals = _places()
    weight = _TURNED * start.size
    tree = cKDTree(np.c_[target.vertices, weight * target.normals])
    eyes = eye_places(packaged_head().mesh) if len(target.eyes) else np.zeros((0, 3))
    warp: Callable[[np.ndarray], np.ndarray] = start
    for stiff in _STIFF:
        placed = warp(source)
        facing = warp(source + _STEP * normals) - placed
        facing /= np.maximum(np.sqrt((facing**2).sum(axis=1, keepdims=True)), 1e-12)
        _, nearest = tree.query(np.c_[placed, weight * facing])
        goal = target.vertices[nearest]
        fits = (target.normals[nearest] * facing).sum(axis=1) > _FACING
        fits &= np.sqrt(((goal - placed) ** 2).sum(axis=1)) < _REACH * start.size
        if fits.sum() < _KEPT * len(fits) / 2:
            break
        warp = _smooth(np.r_[source[fits], eyes], np.r_[goal[fits], target.eyes], stiff)
    return warp


_STEP = 1e-3
"""Metres along a normal by which its direction is taken through a warp."""
_UNIT = 0.1
"""Metres that are one to the stiffness of the warp."""


def _smooth(
    source: np.ndarray, goal: np.ndarray, stiff: float
) -> Callable[[np.ndarray], np.ndarray]:
    made = RBFInterpolator(source / _UNIT, goal, kernel="linear", degree=1, smoothing=stiff)
    return lambda points: np.asarray(made(points / _UNIT))


@cache
def _places() -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 3) on the skin of the packaged head's front, its control points among them, and their normals."""
    head, net = packaged_head(), packaged_net()
    hidden = np.concatenate([head.mesh.of_part(p) for p in (*LOOSE, "mouth", "socket")])
    skin = np.setdiff1d(np.unique(head.mesh.faces), hidden)
    skin = skin[head.mesh.vertices[skin, 2] > _BEHIND]
    some = skin[np.linspace(0, len(skin) - 1, _PLACES).round().astype(int)]
    rows = np.unique(np.r_[some, net.vertices])
    return head.mesh.vertices[rows], head.mesh.normals()[rows]


def eye_places(mesh: Mesh) -> np.ndarray:
    """Middles and sides (14, 3) of the two eyeballs, that which lies further along -x first.

    None (0, 3) where no two eyes are known as parts, or they do not lie beside each other.
    """
    eyes = mesh.vertices[mesh.of_part("eye").astype(int)]
    if len(eyes) < 8:
        return np.zeros((0, 3))
    middle = (eyes[:, 0].min() + eyes[:, 0].max()) / 2
    made = []
    for ball in (eyes[eyes[:, 0] < middle], eyes[eyes[:, 0] >= middle]):
        centre, half = (ball.min(axis=0) + ball.max(axis=0)) / 2, np.ptp(ball, axis=0) / 2
        made += [centre, *(centre + half * np.eye(3)), *(centre - half * np.eye(3))]
    return np.array(made)


def _similarity(source: np.ndarray, target: np.ndarray) -> _Similarity:
    """What brings points onto others by least squares."""
    origin, end = source.mean(axis=0), target.mean(axis=0)
    u, s, w = np.linalg.svd((target - end).T @ (source - origin))
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ w))])
    size = float((s * sign).sum() / ((source - origin) ** 2).sum())
    return _Similarity((u * sign) @ w, size, origin, end)


def faults(points: np.ndarray) -> list[str]:
    """What of a face is not where a face has it, by control points (P, 3); empty where all is.

    Lips in order, the nose before and over them, and no part creased or blown up against the others.
    """
    net = packaged_net()
    still = net.at(packaged_head().mesh.vertices)
    straight = points @ upright(points).T
    at = dict(zip(net.names, straight, strict=True))
    outer = np.array([p for name, p in at.items() if name.startswith("lips_outer")])
    inner = np.array([p for name, p in at.items() if name.startswith("lips_inner")])
    nose = at["nose_bridge06"]
    half = len(outer) // 2
    found = {
        "the lips": outer[1:half, 1].mean() <= outer[half + 1 :, 1].mean(),
        "the corners of the mouth": outer[:, 0].argmin() not in (0, 1, len(outer) - 1),
        "the inner lips": np.ptp(inner[:, 0]) > 1.2 * np.ptp(outer[:, 0]),
        "the nose": nose[2] <= outer[:, 2].mean() or nose[1] <= outer[:, 1].mean(),
        "the face": _creased(still, straight, net.triangles) > np.log(_CREASED),
    }
    return [name for name, fault in found.items() if fault]


def _creased(still: np.ndarray, points: np.ndarray, triangles: np.ndarray) -> float:
    """Mean size of the logarithm of how triangles grew, against the usual."""
    a, b = (
        np.sqrt((np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0]) ** 2).sum(axis=1))
        for v in (still[triangles], points[triangles])
    )
    grew = np.log(np.maximum(b, 1e-12 * b.max()) / a)
    return float(np.abs(grew - np.median(grew)).mean())


def _checked(target: _Target, points: np.ndarray) -> np.ndarray:
    """The guessed points, where they make a face and lie on the mesh."""
    wrong = faults(points)
    away, _ = cKDTree(target.vertices).query(points)
    if float(np.median(away)) > _FAR * np.ptp(points, axis=0).max():
        wrong.append("the points")
    if wrong:
        raise DnnvssError(f"{', '.join(wrong)} could not be found in this mesh", remedy=REMEDY)
    return points
