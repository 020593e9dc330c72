"""The jaw of a mesh that follows points: lower teeth and tongue go where the chin says.

How the chin moved tells three weights, of the packaged head's jaw opened, put forward and to the
side; these move lower teeth and tongue as they move the packaged head's.
"""

from dataclasses import dataclass

import numpy as np

from dnnvss.face.mesh.head import packaged_head
from dnnvss.face.mesh.net import packaged_net
from dnnvss.face.mesh.surface import Mesh
from dnnvss.face.mesh.volume import Warp, slopes

CARRIED = ("lower_teeth", "tongue")
"""Parts that the jaw carries."""
_SHAPES = ("jawOpen", "jawForward", "jawLeft")
_CHIN = 3
"""Control points of the chin, the lowest of the face's oval."""


@dataclass(frozen=True)
class Jaw:
    """How a jaw follows its chin.

    Args:
        chin: control points of the chin.
        rest: where they are at rest, on average (3,).
        weights: of the jaw's shapes for a movement of the chin (3, 3), a row each.
        carried: vertices that follow (n,).
        moves: how the shapes move them (3, n, 3).
    """

    chin: np.ndarray
    rest: np.ndarray
    weights: np.ndarray
    carried: np.ndarray
    moves: np.ndarray

    def move(self, vertices: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Vertices (V, 3) with those of the jaw where control points (P, 3) put it; changed in place."""
        weights = self.weights @ (points[self.chin].mean(axis=0) - self.rest)
        vertices[self.carried] += np.tensordot(weights, self.moves, axes=1)
        return vertices


def jaw_of(mesh: Mesh, points: np.ndarray, there: Warp, back: Warp) -> Jaw:
    """The jaw of a mesh.

    Args:
        mesh: whose parts :data:`CARRIED` it carries.
        points: its control points (P, 3) at rest.
        there, back: from the packaged head to the mesh, and from the mesh to the head.
    """
    head, net = packaged_head(), packaged_net()
    v = head.mesh.vertices
    oval = [k for k, name in enumerate(net.names) if name.startswith("face_oval")]
    chin = np.array(sorted(oval, key=lambda k: v[net.vertices[k], 1])[:_CHIN])
    shapes = head.shapes[[head.position(name) for name in _SHAPES]].astype(float)
    told = shapes[:, net.vertices[chin]].mean(axis=1)
    to_mesh = slopes(there, v[net.vertices[chin]].mean(axis=0)[None])[0]
    carried = np.unique(np.concatenate([mesh.of_part(part) for part in CARRIED])).astype(int)
    own = back(mesh.vertices[carried]) if len(carried) else np.zeros((0, 3))
    teeth = head.mesh.of_part("lower_teeth")
    whole, ours = (np.column_stack([x, np.ones(len(x))]) for x in (v[teeth], own))
    moved = np.stack(
        [ours @ np.linalg.lstsq(whole, shape[teeth], rcond=None)[0] for shape in shapes]
    )
    moves = np.einsum("nij,snj->sni", slopes(there, own), moved)
    return Jaw(
        chin, points[chin].mean(axis=0), np.linalg.pinv((told @ to_mesh.T).T), carried, moves
    )
