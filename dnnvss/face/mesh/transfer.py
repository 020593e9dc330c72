"""The packaged head's shapes on any other mesh: a warp from neutral to neutral, and the surface that carries it.

**Source.** J. D. Edge, M. A. Sanchez, S. Maddock, 2004, section 6: the warp of the neutral faces is
applied to every frame, relative to the neutral, and the mesh follows the points by a deformer of
Bezier triangles.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.mesh.bezier import BezierSurface
from dnnvss.face.mesh.deformer import Deformer, bind
from dnnvss.face.mesh.eyes import eye_shapes
from dnnvss.face.mesh.guess import REMEDY, guess_points
from dnnvss.face.mesh.head import Head, packaged_head
from dnnvss.face.mesh.jaw import Jaw, jaw_of
from dnnvss.face.mesh.net import packaged_net
from dnnvss.face.mesh.surface import Mesh
from dnnvss.face.mesh.volume import Warp, fit_warp

_LINE = 0.01
"""Share of their length that named points spread aside at least."""


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
    for name, (rows, moved) in eye_shapes(mesh, float(transfer.rest[:, 0].mean())).items():
        made[head.position(name)][rows] = moved
    return Head(mesh, head.names, np.array(made, np.float32))


def find_points(mesh: Mesh, named: Mapping[str, np.ndarray] | None = None) -> np.ndarray:
    """Where the control points of the packaged head lie in a mesh (P, 3).

    Args:
        mesh: at rest.
        named: some of them by name (3,), between which a warp tells the others; where None all are guessed from the
            shapes of the two heads, see :mod:`dnnvss.face.mesh.guess`.

    Raises:
        DnnvssError: an unknown name, too few names, or a guess that does not fit.
    """
    if named is None:
        return guess_points(mesh)
    net = packaged_net()
    still = net.at(packaged_head().mesh.vertices)
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
        raise DnnvssError("the points that are named lie on a line or in one place", remedy=REMEDY)
    return fit_warp(still[rows], points)(still)
