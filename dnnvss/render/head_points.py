"""Points on a mesh, seen from the front and from both sides: pictures, and the place under a pixel."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial import cKDTree

from dnnvss.face.mesh.deformer import LOOSE
from dnnvss.face.mesh.surface import Mesh
from dnnvss.media.pictures import write_picture
from dnnvss.render.solid import Camera, Solid, whole_head

VIEWS = {"front": 0.0, "right side": 40.0, "left side": -40.0}
"""Where a mesh is seen from, and the degrees by which it is turned for that."""
COLOURS = ("#d1495b", "#e08b2f", "#2f86c8", "#3f9e57", "#8f62c9", "#c9609b", "#2a9d8f", "#a39a22", "#64748b")
"""Of groups of points, in their order."""


@dataclass(frozen=True)
class View:
    """A mesh, seen from one side.

    Args:
        mesh: upright.
        camera: from where.
    """

    mesh: Mesh
    camera: Camera

    @classmethod
    def of(cls, mesh: Mesh, name: str, height: int) -> "View":
        """A view of :data:`VIEWS`, some pixels high."""
        return cls(mesh, whole_head(mesh, height, VIEWS[name]))

    @cached_property
    def picture(self) -> np.ndarray:
        """Of the mesh alone, uint8 RGB (H, W, 3)."""
        return Solid(self.mesh, self.camera, smooth=2).picture(self.mesh.vertices)

    @cached_property
    def _triangles(self) -> np.ndarray:
        """Corners in pixels and depth (M, 3, 3) of what faces the viewer and is not inside."""
        names = np.array([part in LOOSE for part in self.mesh.parts])
        shown = self.mesh.triangles[~names[self.mesh.triangle_parts]]
        seen = self.camera.seen(self.mesh.vertices)[shown]
        one, two = seen[:, 1, :2] - seen[:, 0, :2], seen[:, 2, :2] - seen[:, 0, :2]
        return seen[one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0] < -1e-9]

    def place(self, x: float, y: float) -> np.ndarray | None:
        """The place (3,) of the mesh that is seen at a pixel; None where there is none."""
        a, b, c = (self._triangles[:, k] for k in range(3))
        u, v, w = (
            (p[:, 0] - x) * (q[:, 1] - y) - (p[:, 1] - y) * (q[:, 0] - x)
            for p, q in ((b, c), (c, a), (a, b))
        )
        inside = np.flatnonzero((u <= 0) & (v <= 0) & (w <= 0))
        if not len(inside):
            return None
        shares = np.stack([u, v, w], axis=1)[inside]
        shares /= shares.sum(axis=1, keepdims=True)
        depth = (shares * self._triangles[inside, :, 2]).sum(axis=1).max()
        width, height = self.camera.size
        scale = height / self.camera.height
        flat = np.array([x - width / 2, height / 2 - y, depth]) / scale
        return np.asarray(flat @ self.camera.axes + self.camera.centre)

    def seen(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pixels (n, 2) of places (n, 3), and whether (n,) the mesh there faces the viewer."""
        if not len(places):
            return np.zeros((0, 2)), np.zeros(0, bool)
        _, nearest = self._tree.query(places)
        facing = self._normals[nearest] @ self.camera.axes[2]
        return self.camera.seen(places)[:, :2], facing > 0

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.mesh.vertices)

    @cached_property
    def _normals(self) -> np.ndarray:
        return self.mesh.normals()


def group_of(name: str) -> str:
    """The group of a point, its name without the number."""
    return name.rstrip("0123456789")


def draw_points(path: Path, mesh: Mesh, points: Mapping[str, np.ndarray], height: int = 640) -> None:
    """Write a picture of a mesh, upright, from all sides, with points (3,) by name in the colours of their groups."""
    groups = list(dict.fromkeys(map(group_of, points)))
    parts = []
    for name in VIEWS:
        view = View.of(mesh, name, height)
        image = view.picture.copy()
        at, shown = view.seen(np.array(list(points.values())).reshape(-1, 3))
        for point, place, faces in zip(points, at, shown, strict=True):
            if faces:
                colour = COLOURS[groups.index(group_of(point)) % len(COLOURS)].removeprefix("#")
                rgb = tuple(bytes.fromhex(colour))
                cv2.circle(image, (round(place[0] * 16), round(place[1] * 16)), 52, (255,) * 3, -1, cv2.LINE_AA, 4)
                cv2.circle(image, (round(place[0] * 16), round(place[1] * 16)), 40, rgb, -1, cv2.LINE_AA, 4)
        parts.append(image)
    write_picture(path, np.hstack(parts))
