"""The eyes of a mesh that look where the packaged head's look: each turns about its own middle."""

from dataclasses import dataclass

import numpy as np

from dnnvss.face.mesh.head import packaged_head
from dnnvss.face.mesh.surface import Mesh

PARTS = ("eye", "iris", "pupil")
_LOOKS = ("eyeLookUp", "eyeLookDown", "eyeLookIn", "eyeLookOut")
_SIDES = (("Left", 1), ("Right", -1))
_FEWEST = 12
"""Vertices that an eyeball has at least."""


@dataclass(frozen=True)
class Eyeball:
    """An eye that turns.

    Args:
        rows: its vertices (n,).
        middle: of the sphere nearest to them (3,).
    """

    rows: np.ndarray
    middle: np.ndarray

    @classmethod
    def of(cls, mesh: Mesh, side: int, line: float) -> "Eyeball | None":
        """The eyeball of a mesh that looks along z, on a side (1: the talker's left) of x = ``line``; None without."""
        rows = np.unique(np.concatenate([mesh.of_part(part) for part in PARTS])).astype(int)
        rows = rows[side * (mesh.vertices[rows, 0] - line) > 0]
        if len(rows) < _FEWEST:
            return None
        v = mesh.vertices[rows]
        near = v - v.mean(axis=0)
        spread = np.sqrt((near**2).sum(axis=1).mean()) or 1.0
        sphere = np.linalg.lstsq(np.column_stack([2 * near / spread, np.ones(len(v))]),
                                 ((near / spread) ** 2).sum(axis=1), rcond=None)[0]
        return cls(rows, v.mean(axis=0) + spread * sphere[:3])

    def moved(self, vertices: np.ndarray, rotation: np.ndarray) -> np.ndarray:
        """How its vertices (n, 3) move where it turns by ``rotation`` (3, 3)."""
        return (vertices[self.rows] - self.middle) @ (rotation - np.eye(3)).T


def eye_shapes(mesh: Mesh, line: float) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """How the eyes of a mesh move with the packaged head's shapes: name to vertices (n,) and their movement (n, 3).

    Args:
        mesh: at rest; y is up, and the face looks along z.
        line: the x that parts left from right.
    """
    head, made = packaged_head(), {}
    irises = np.union1d(head.mesh.of_part("iris"), head.mesh.of_part("pupil"))
    front = {name: irises[side * head.mesh.vertices[irises, 0] > 0] for name, side in _SIDES}
    for name, side in _SIDES:
        own, theirs = Eyeball.of(head.mesh, side, 0.0), Eyeball.of(mesh, side, line)
        if own is None or theirs is None:
            continue
        for look in _LOOKS:
            shape = head.shapes[head.position(look + name)][front[name]]
            rotation = _turn(head.mesh.vertices[front[name]] - own.middle, shape)
            made[look + name] = theirs.rows, theirs.moved(mesh.vertices, rotation)
    return made


def _turn(places: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """The rotation (3, 3) about 0 that moves places (n, 3) nearest to where they go (Kabsch 1976)."""
    left, _, right = np.linalg.svd((places + moved).T @ places)
    return np.asarray(left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right)
