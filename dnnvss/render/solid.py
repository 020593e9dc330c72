"""A head as a lit surface, drawn from the back to the front; needs no graphics card."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from dnnvss.face.mesh import Mesh
from dnnvss.face.mesh.parts import part_colour
from dnnvss.face.mesh.turns import Turns
from dnnvss.render.fill import fill_for

_GROUND = (250, 248, 245)
_BEHIND = ("mouth", "upper_teeth", "lower_teeth", "tongue", "socket", "eye", "iris", "pupil")
"""Parts that lie behind the skin, from the back to the front; what is not of them is skin."""
_DARK = {"mouth": 0.55, "upper_teeth": 0.85, "lower_teeth": 0.8, "tongue": 0.85}
"""How much light reaches parts inside the mouth."""
_LIGHT = np.array([-0.3, 0.45, 0.84])
_AMBIENT, _GLOSS = 0.42, 0.16
_ROOM = 1.06


@dataclass(frozen=True)
class Camera:
    """From where a head is seen, without perspective.

    Args:
        centre: the place (3,) in the middle of the picture.
        height: of what is seen, in units of the mesh.
        turn, nod: degrees by which the head is turned to its left and raised.
        size: width and height of the picture in pixels.
    """

    centre: np.ndarray
    height: float
    turn: float = 0.0
    nod: float = 0.0
    size: tuple[int, int] = (400, 480)

    @property
    def axes(self) -> np.ndarray:
        """Right, up and towards the viewer (3, 3), a row each."""
        t, n = np.deg2rad([self.turn, self.nod])
        turned = np.array([[np.cos(t), 0, np.sin(t)], [0, 1, 0], [-np.sin(t), 0, np.cos(t)]])
        raised = np.array([[1, 0, 0], [0, np.cos(n), np.sin(n)], [0, -np.sin(n), np.cos(n)]])
        return raised @ turned

    def seen(self, vertices: np.ndarray) -> np.ndarray:
        """Pixels and depth (V, 3) of vertices (V, 3); larger is nearer."""
        scale = self.size[1] / self.height
        at = (vertices - self.centre) @ self.axes.T * scale
        return at * [1, -1, 1] + [self.size[0] / 2, self.size[1] / 2, 0]


def whole_head(mesh: Mesh, height: int = 480, turn: float = 0.0, turns: Turns | None = None) -> Camera:
    """A camera that sees all of a mesh, in all frames where it turns.

    Args:
        mesh: the head at rest.
        height: of the picture in pixels.
        turn: degrees by which it is seen turned.
        turns: how it turns in a take.
    """
    low, high = turns.reach(mesh) if turns else (mesh.vertices.min(axis=0), mesh.vertices.max(axis=0))
    span = (high - low) * _ROOM
    width = 2 * round(height * max(span[0], abs(np.sin(np.deg2rad(turn))) * span[2]) / span[1] / 2)
    return Camera((low + high) / 2, float(span[1]), turn, size=(max(width, 2), 2 * (height // 2)))


class Solid:
    """Draws a mesh in any pose.

    Args:
        mesh: whose faces and parts are drawn.
        camera: from where.
        smooth: drawn pixels for each pixel of the picture, along each axis.

    Raises:
        DnnvssError: see :func:`~dnnvss.render.fill.fill_for`.
    """

    def __init__(self, mesh: Mesh, camera: Camera, smooth: int = 1) -> None:
        self.mesh, self.camera = mesh, camera
        self.fill = fill_for(camera.size, _GROUND, smooth)
        self.colours = np.array([part_colour(p) for p in mesh.parts], float)[mesh.part_of]
        self.light = np.array([_DARK.get(p, 1.0) for p in mesh.parts])[mesh.part_of]
        layers = [_BEHIND.index(p) if p in _BEHIND else len(_BEHIND) for p in mesh.parts]
        layers = [min(layer, 1) if layer < _BEHIND.index("socket") else layer for layer in layers]
        self.layer = np.array(layers, float)[mesh.part_of]
        self.tongue = np.array([p == "tongue" for p in mesh.parts])[mesh.part_of]
        self.lips = mesh.of_part("lips")

    def frames(
        self, movement: Iterator[np.ndarray] | Sequence[np.ndarray] | np.ndarray
    ) -> Iterator[np.ndarray]:
        """Yield a picture, uint8 RGB (H, W_, 3), for each set of vertices (V, 3)."""
        return (self.picture(vertices) for vertices in movement)

    def picture(self, vertices: np.ndarray) -> np.ndarray:
        """A picture, uint8 RGB (H, W_, 3), of vertices (V, 3)."""
        seen = self.camera.seen(vertices)
        corners = seen[self.mesh.faces]
        a, b = corners[:, 2, :2] - corners[:, 0, :2], corners[:, 3, :2] - corners[:, 1, :2]
        flat = self.mesh.faces[:, 2] == self.mesh.faces[:, 3]
        b[flat] = corners[flat, 2, :2] - corners[flat, 1, :2]
        shown = np.flatnonzero(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] < 0)
        depth = corners[shown, :, 2].mean(axis=1)
        order = shown[np.lexsort((depth, self._layers(shown, depth, seen)))]
        return self.fill(corners[order, :, :2], self._shades(vertices)[order])

    def _layers(self, shown: np.ndarray, depth: np.ndarray, seen: np.ndarray) -> np.ndarray:
        """The layer of each face that is shown; a tongue that is put out comes before the lips."""
        layer = self.layer[shown].copy()
        if len(self.lips):
            out = self.tongue[shown] & (depth > np.median(seen[self.lips, 2]))
            layer[out] = len(_BEHIND)
        return layer

    def _shades(self, vertices: np.ndarray) -> np.ndarray:
        """Colours (N, 3) of the faces, lit by the normals of their corners, so that edges hardly show."""
        normals = self.mesh.normals(vertices) @ self.camera.axes.T.astype(vertices.dtype)
        light = normals @ _LIGHT.astype(vertices.dtype)
        lit = np.clip(light[self.mesh.faces].mean(axis=1), 0, 1)
        shade = (_AMBIENT + (1 - _AMBIENT) * lit) * self.light
        return np.clip(
            self.colours * shade[:, None] + 255 * _GLOSS * (lit**12 * self.light)[:, None], 0, 255
        )
