"""The packaged head's shapes on any other mesh: a warp from neutral to neutral, and the surface that carries it.

**Source.** J. D. Edge, M. A. Sanchez, S. Maddock, 2004, section 6: the warp of the neutral faces is
applied to every frame, relative to the neutral, and the mesh follows the points by a deformer of
Bezier triangles.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from dnnvss.errors import DnnvssError
from dnnvss.face.mesh.bezier import BezierSurface
from dnnvss.face.mesh.deformer import Deformer, bind
from dnnvss.face.mesh.head import Head, packaged_head
from dnnvss.face.mesh.jaw import Jaw, jaw_of
from dnnvss.face.mesh.net import packaged_net
from dnnvss.face.mesh.surface import Mesh
from dnnvss.face.mesh.volume import Warp, fit_warp

_ROUNDS, _KEPT, _FACING = 40, 0.7, 0.5
"""Rounds of the search for the head in a mesh, the share of points that count, how alike normals are."""
_FAR = 0.03
"""Share of the head's height by which the guess may miss the mesh, at most."""
_LINE = 0.01
"""Share of their length that named points spread aside at least."""
_SOFT = ("lips_inner", "right_eye", "left_eye", "right_lid", "left_lid")
"""Rings of which the nearest place may be that of the other lip or lid; they follow the points around."""
_REMEDY = (
    'Turn the mesh so that it looks along z with y up, or name some of its points: --points FILE.json with {"nose_'
    'bridge07": 123, "lips_outer01": [x, y, z], ...}; `dnnvss rig --names` lists them'
)


@dataclass(frozen=True)
class Transfer:
    """What moves a mesh as the packaged head moves.

    Args:
        warp: from the head's space to the mesh's.
        rest: the mesh's control points (P, 3).
        deformer: of the mesh.
        jaw: of the mesh.
    """

    warp: Warp
    rest: np.ndarray
    deformer: Deformer
    jaw: Jaw

    def points(self, vertices: np.ndarray) -> np.ndarray:
        """Control points (..., P, 3) of the mesh for vertices (..., V, 3) of the packaged head."""
        net = packaged_net()
        still = net.at(packaged_head().mesh.vertices)
        return self.rest + self.warp(net.at(vertices)) - self.warp(still)

    def vertices(self, vertices: np.ndarray) -> np.ndarray:
        """The mesh (V', 3) for vertices (V, 3) of the packaged head."""
        points = self.points(vertices)
        return self.jaw.move(self.deformer.vertices(points), points)


def transfer_to(mesh: Mesh, points: np.ndarray) -> Transfer:
    """What moves a mesh with known control points.

    Args:
        mesh: at rest.
        points: where the control points of the packaged head lie in it (P, 3), see :func:`find_points`.
    """
    net = packaged_net()
    surface = BezierSurface(net.triangles, len(net.names))
    still = net.at(packaged_head().mesh.vertices)
    warp, back = fit_warp(still, points), fit_warp(points, still)
    return Transfer(warp, points, bind(mesh, surface, points), jaw_of(mesh, points, warp, back))


def with_shapes(mesh: Mesh, transfer: Transfer) -> Head:
    """A mesh with the shapes of the packaged head, each as far as that goes at weight 1."""
    head = packaged_head()
    made = [transfer.vertices(head.mesh.vertices + shape) - mesh.vertices for shape in head.shapes]
    return Head(mesh, head.names, np.array(made, np.float32))


def find_points(mesh: Mesh, named: Mapping[str, np.ndarray] | None = None) -> np.ndarray:
    """Where the control points of the packaged head lie in a mesh (P, 3).

    Args:
        mesh: at rest, y up, looking along z.
        named: some of them by name (3,); where None all are guessed: the head is laid onto the mesh by a similarity,
            and its control points go to the nearest places that look the same way.

    Raises:
        DnnvssError: an unknown name, too few names, or a guess that does not fit.
    """
    net, head = packaged_net(), packaged_head()
    still = net.at(head.mesh.vertices)
    if named is not None:
        known = {name: k for k, name in enumerate(net.names)}
        if unknown := [name for name in named if name not in known]:
            raise DnnvssError(
                f"no point of the head is named {unknown[0]!r}",
                remedy="dnnvss rig --names lists them",
            )
        rows = [known[name] for name in named]
        points = np.array(list(named.values()), float)
        spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        if not spread[1] > _LINE * spread[0]:
            raise DnnvssError(
                "the points that are named lie on a line or in one place", remedy=_REMEDY
            )
        return fit_warp(still[rows], points)(still)
    return _checked(mesh, _guessed(mesh, head, net.vertices))


def _guessed(mesh: Mesh, head: Head, rows: np.ndarray) -> np.ndarray:
    """The control points laid onto the mesh."""
    source, normals = head.mesh.vertices[rows], head.mesh.normals()[rows]
    outside = np.ones(len(mesh.vertices), bool)
    outside[
        np.concatenate(
            [
                mesh.of_part(p)
                for p in ("eye", "iris", "pupil", "upper_teeth", "lower_teeth", "tongue")
            ]
        ).astype(int)
    ] = False
    target, facing = mesh.vertices[outside], mesh.normals()[outside]
    scale = np.ptp(target[:, 1]) / np.ptp(head.mesh.vertices[:, 1])
    centres = [(v.min(axis=0) + v.max(axis=0)) / 2 for v in (target, head.mesh.vertices)]
    placed = (source - centres[1]) * scale + centres[0]
    turned, tree = normals, cKDTree(target)
    for _ in range(_ROUNDS):
        away, nearest = tree.query(placed, k=8)
        fits = np.einsum("pkd,pd->pk", facing[nearest], turned) > _FACING
        best = fits.argmax(axis=1)
        distance = np.where(fits.any(axis=1), away[np.arange(len(best)), best], np.inf)
        counted = np.flatnonzero(distance <= np.quantile(distance, _KEPT))
        goal = target[nearest[np.arange(len(best)), best]]
        turn, size, origin, end = _similarity(source[counted], goal[counted])
        placed, turned = (source - origin) @ turn.T * size + end, normals @ turn.T
    away = np.sqrt(((placed - goal) ** 2).sum(axis=1))
    close = np.isfinite(distance) & (away < _FAR * np.ptp(placed[:, 1]))
    if close.mean() < 0.6:
        raise DnnvssError(
            f"the head fits this mesh at {close.mean():.0%} of its points", remedy=_REMEDY
        )
    firm = close & np.array([not name.startswith(_SOFT) for name in packaged_net().names])
    own, theirs = _eyes(head.mesh), _eyes(mesh)
    if len(theirs) == len(own):
        placed_eyes = (own - origin) @ turn.T * size + end
        return fit_warp(np.r_[placed[firm], placed_eyes], np.r_[goal[firm], theirs])(placed)
    return fit_warp(placed[firm], goal[firm])(placed)


def _eyes(mesh: Mesh) -> np.ndarray:
    """The middle of each eyeball, and places beside, over and before it; none where no two eyes are known as parts."""
    eyes = mesh.vertices[mesh.of_part("eye").astype(int)]
    if len(eyes) < 8:
        return np.zeros((0, 3))
    middle = (eyes[:, 0].min() + eyes[:, 0].max()) / 2
    made = []
    for ball in (eyes[eyes[:, 0] < middle], eyes[eyes[:, 0] >= middle]):
        centre, half = (ball.min(axis=0) + ball.max(axis=0)) / 2, np.ptp(ball, axis=0) / 2
        made += [centre, *(centre + half * np.eye(3)), *(centre - half * np.eye(3))]
    return np.array(made)


def _similarity(
    source: np.ndarray, target: np.ndarray
) -> tuple[np.ndarray, float, np.ndarray, np.ndarray]:
    """Turn, size, and the two middles that bring points onto others."""
    origin, end = source.mean(axis=0), target.mean(axis=0)
    u, s, w = np.linalg.svd((target - end).T @ (source - origin))
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ w))])
    return (u * sign) @ w, float((s * sign).sum() / ((source - origin) ** 2).sum()), origin, end


def _checked(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    """The guessed points, where they make a face: lips in order, the nose before them, all near the mesh."""
    net = packaged_net()
    at = dict(zip(net.names, points, strict=True))
    outer = np.array([p for name, p in at.items() if name.startswith("lips_outer")])
    inner = np.array([p for name, p in at.items() if name.startswith("lips_inner")])
    nose = at["nose_bridge06"]
    half = len(outer) // 2
    faults = {
        "the lips": outer[1:half, 1].mean() <= outer[half + 1 :, 1].mean(),
        "the corners of the mouth": outer[:, 0].argmin() not in (0, 1, len(outer) - 1),
        "the inner lips": np.ptp(inner[:, 0]) > 1.2 * np.ptp(outer[:, 0]),
        "the nose": nose[2] <= outer[:, 2].mean() or nose[1] <= outer[:, 1].mean(),
    }
    away, _ = cKDTree(mesh.vertices).query(points)
    faults["the points"] = float(np.median(away)) > _FAR * np.ptp(points[:, 1])
    if wrong := [name for name, fault in faults.items() if fault]:
        raise DnnvssError(f"{', '.join(wrong)} could not be found in this mesh", remedy=_REMEDY)
    return points
