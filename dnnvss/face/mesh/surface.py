"""A surface of triangles and quadrangles in space, within bounds, and its normals."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from dnnvss.errors import DnnvssError

MOST_VERTICES, MOST_FACES = 500_000, 1_000_000
"""What a mesh may have at most; a face for animation has thousands."""
LARGEST = 1e6
"""How far from 0 a vertex may lie."""
_REMEDY = "Export the head alone, without hair and body, with fewer vertices"


@dataclass(frozen=True)
class Mesh:
    """A surface whose faces have three or four corners.

    Args:
        vertices: positions (V, 3), y up and z towards the viewer of a face that looks forward.
        faces: corners (N, 4) among the vertices, counter-clockwise from outside; a triangle repeats its third.
        parts: names of what the faces belong to.
        part_of: position (N,) of each face's part.

    Raises:
        DnnvssError: no faces, a corner that is no vertex, numbers that are not finite, or too many of them.
    """

    vertices: np.ndarray
    faces: np.ndarray
    parts: Sequence[str] = ("skin",)
    part_of: np.ndarray = field(default_factory=lambda: np.zeros(0, np.uint8))

    def __post_init__(self) -> None:
        check_size(len(self.vertices), len(self.faces))
        if not len(self.faces):
            raise DnnvssError(
                "a mesh without faces cannot be shown", remedy="Export it with its faces"
            )
        if self.faces.min() < 0 or self.faces.max() >= len(self.vertices):
            raise DnnvssError(
                f"a face names vertex {int(self.faces.max())}, and there are {len(self.vertices)}",
                remedy="Export the mesh again",
            )
        if not (np.isfinite(self.vertices).all() and np.abs(self.vertices).max() <= LARGEST):
            raise DnnvssError(
                "a vertex lies nowhere, or further away than any head is large",
                remedy="Export the mesh again",
            )
        if len(self.part_of) == 0:
            object.__setattr__(self, "part_of", np.zeros(len(self.faces), np.uint8))

    @cached_property
    def triangles(self) -> np.ndarray:
        """Corners (M, 3): quadrangles as two triangles."""
        second = self.faces[self.faces[:, 2] != self.faces[:, 3]]
        return np.concatenate([self.faces[:, :3], second[:, [0, 2, 3]]])

    @cached_property
    def triangle_parts(self) -> np.ndarray:
        """The part (M,) of each of :attr:`triangles`."""
        return np.concatenate([self.part_of, self.part_of[self.faces[:, 2] != self.faces[:, 3]]])

    @cached_property
    def edges(self) -> np.ndarray:
        """Pairs (E, 2) of vertices that a face joins, each once."""
        f = self.faces
        pairs = np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 3]], f[:, [3, 0]]])
        apart = pairs[:, 0] != pairs[:, 1]
        return np.unique(np.sort(pairs[apart], axis=1), axis=0)

    @cached_property
    def spread(self) -> sparse.csr_array:
        """What sums the values of faces (N,) at their corners: a matrix (V, N)."""
        corners = np.where(
            np.arange(4) == 3,
            np.where(self.faces[:, 2:3] == self.faces[:, 3:], -1, self.faces[:, 3:]),
            self.faces,
        )
        face, side = np.nonzero(corners >= 0)
        ones = np.ones(len(face), np.float32)
        return sparse.csr_array(
            (ones, (corners[face, side], face)), shape=(len(self.vertices), len(self.faces))
        )

    def face_normals(self, vertices: np.ndarray | None = None) -> np.ndarray:
        """Normals (N, 3) of the faces, as long as twice their area.

        Args:
            vertices: (V, 3) in place of the mesh's own.
        """
        v = self.vertices if vertices is None else vertices
        a, b, c, d = (v[self.faces[:, k]] for k in range(4))
        flat = self.faces[:, 2] == self.faces[:, 3]
        across = np.where(flat[:, None], c - b, d - b)
        p, q = c - a, across
        return np.stack(
            [
                p[:, 1] * q[:, 2] - p[:, 2] * q[:, 1],
                p[:, 2] * q[:, 0] - p[:, 0] * q[:, 2],
                p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0],
            ],
            axis=1,
        )

    def normals(self, vertices: np.ndarray | None = None) -> np.ndarray:
        """Normals (V, 3) of length 1 at the vertices; zero at those of no face.

        Args:
            vertices: (V, 3) in place of the mesh's own.
        """
        summed = self.spread @ self.face_normals(vertices)
        return summed / np.maximum(np.sqrt((summed**2).sum(axis=1, keepdims=True)), 1e-20)

    @property
    def outward(self) -> "Mesh":
        """The mesh, its faces turned over where they look into the space that they enclose."""
        middle = self.vertices.mean(axis=0)
        outside = self.face_normals() * (self.vertices[self.faces[:, 0]] - middle)
        if outside.sum() >= 0:
            return self
        a, b, c, d = self.faces.T
        turned = np.where((c == d)[:, None], np.stack([a, c, b, b], 1), np.stack([a, d, c, b], 1))
        return replace(self, faces=turned)

    def of_part(self, name: str) -> np.ndarray:
        """The vertices of the faces of a part; none where there is no such part."""
        if name not in self.parts:
            return np.zeros(0, int)
        return np.unique(self.faces[self.part_of == list(self.parts).index(name)])


def check_size(vertices: int, faces: int = 0) -> None:
    """Refuse more vertices or faces than a mesh may have.

    Raises:
        DnnvssError: they are more.
    """
    if vertices > MOST_VERTICES or faces > MOST_FACES:
        raise DnnvssError(
            f"a mesh of {vertices:,} vertices and {faces:,} faces is too large: {MOST_VERTICES:,} and "
            f"{MOST_FACES:,} are the most",
            remedy=_REMEDY,
        )
