"""A head with named shapes: the one that ships with the package, and others in its form."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path

import numpy as np

from dnnvss.archives import Held, read_declared
from dnnvss.errors import DnnvssError
from dnnvss.face.mesh.surface import Mesh
from dnnvss.face.mesh.turns import Turns

HEAD_FILE = Path(__file__).with_name("head.npz")
UNIT = 1e-5
"""Metres of the whole numbers in which the packaged head keeps its vertices and shapes: exactly those of its source."""

_HELD = {
    "vertices": Held(("V", 3), "i"),
    "faces": Held(("N", 4), "u"),
    "part_of": Held(("N",), "u"),
    "parts": Held(("A",), "U"),
    "names": Held(("S",), "U"),
    "counts": Held(("S",), "u"),
    "rows": Held(("R",), "u"),
    "moved": Held(("R", 3), "i"),
    "curves": Held(("C",), "U"),
    "curve_counts": Held(("C",), "u"),
    "curve_rows": Held(("Q",), "u"),
}
_REMEDY = "Install the package again"


@dataclass(frozen=True)
class Head:
    """A mesh with shapes that add up, and named curves on it.

    Vertices for weights ``w`` (S,) are ``v + w B`` with shapes ``B`` (S, V, 3).

    Args:
        mesh: at rest.
        names: of the shapes (S,).
        shapes: how each moves the vertices (S, V, 3).
        curves: name to the vertices that a contour runs through, such as ``lips_outer``; closed where the name says a
            ring, in the order in which face meshes name them: from the talker's right corner over the upper side.
    """

    mesh: Mesh
    names: tuple[str, ...] = ()
    shapes: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 3), np.float32))
    curves: Mapping[str, np.ndarray] = field(default_factory=dict)

    @cached_property
    def flat(self) -> np.ndarray:
        """The shapes as a matrix (S, 3 V)."""
        return np.ascontiguousarray(self.shapes.reshape(len(self.names), -1))

    def vertices(self, weights: np.ndarray) -> np.ndarray:
        """Vertices (..., V, 3) for weights (..., S)."""
        moved = np.asarray(weights, self.flat.dtype) @ self.flat
        return self.mesh.vertices + moved.reshape(*np.shape(weights)[:-1], -1, 3)

    def moved(self, weights: np.ndarray, turns: Turns | None = None) -> Iterator[np.ndarray]:
        """Yield the vertices (V, 3) of each frame, for weights (F, S) and the turns of the head in these frames."""
        for frame, row in enumerate(weights):
            vertices = self.vertices(row)
            yield vertices if turns is None else turns.turned(vertices, frame)

    def weights(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Weights (F, S) of curves by name (F,); shapes without a curve stay at rest, other curves are left.

        Names are compared without regard to case, as tools write them either way.

        Raises:
            DnnvssError: no curve has the name of a shape.
        """
        known = {name.lower(): k for k, name in enumerate(self.names)}
        found = {
            known[name.lower()]: track for name, track in values.items() if name.lower() in known
        }
        if not found:
            raise DnnvssError(
                f"none of the curves {', '.join(list(values)[:5])} is a shape of the head",
                remedy=f"Name them as the head does: {', '.join(self.names[:5])}, ...",
            )
        weights = np.zeros((len(next(iter(found.values()))), len(self.names)), np.float32)
        for k, track in found.items():
            weights[:, k] = track
        return weights

    def position(self, name: str) -> int:
        """Where a shape stands among the names.

        Raises:
            DnnvssError: the head has no such shape.
        """
        if name not in self.names:
            raise DnnvssError(
                f"the head has no shape {name!r}", remedy=f"Use one of {', '.join(self.names)}"
            )
        return self.names.index(name)


@cache
def packaged_head() -> Head:
    """The head that ships with the package: about 4,800 vertices in metres, with the 52 shapes of ARKit.

    **Source.** MakeHuman's base mesh and the face units of Mika Suominen, both CC0 (docs/licences.md);
    :mod:`dnnvss.face.mesh.baking` made the file.
    """
    held = read_declared(HEAD_FILE, _HELD, _REMEDY)
    mesh = Mesh(
        held["vertices"] * UNIT,
        held["faces"].astype(np.int64),
        tuple(map(str, held["parts"])),
        held["part_of"],
    )
    names = tuple(map(str, held["names"]))
    shapes = np.zeros((len(names), len(mesh.vertices), 3), np.float32)
    owner = np.repeat(np.arange(len(names)), held["counts"])
    shapes[owner, held["rows"]] = held["moved"] * np.float32(UNIT)
    return Head(
        mesh, names, shapes, split_rows(held["curves"], held["curve_counts"], held["curve_rows"])
    )


def split_rows(names: np.ndarray, counts: np.ndarray, rows: np.ndarray) -> dict[str, np.ndarray]:
    """Name to its share of rows that follow each other."""
    parts = np.split(rows.astype(int), np.cumsum(counts)[:-1])
    return {str(name): part for name, part in zip(names, parts, strict=True)}


def joined_rows(curves: Mapping[str, Sequence[int]]) -> dict[str, np.ndarray]:
    """The inverse of :func:`split_rows`, as arrays of the head's file."""
    return {
        "curves": np.array(list(curves)),
        "curve_counts": np.array([len(c) for c in curves.values()], np.uint16),
        "curve_rows": np.concatenate([np.asarray(c, np.uint16) for c in curves.values()]),
    }
