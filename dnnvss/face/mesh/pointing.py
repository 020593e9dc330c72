"""Points of the packaged head set by hand on another mesh: a folder that holds them, and how the others follow.

``head.json`` names the mesh and what was set by hand, ``points.json`` holds the points as ``--points``
takes them.
"""

from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.face.mesh.guess import best_turn, guess_points, upright
from dnnvss.face.mesh.head import packaged_head
from dnnvss.face.mesh.net import packaged_net
from dnnvss.face.mesh.other import check_head, read_mesh, read_points
from dnnvss.face.mesh.surface import Mesh
from dnnvss.face.mesh.transfer import find_points
from dnnvss.records import read_record

NAME, POINTS, PICTURE = "head.json", "points.json", "points.png"
FEWEST = 6
"""Points by which the others are told."""
_CARRIED = 0.012
"""Metres of the packaged head within which a point that is moved carries those that were not set by hand."""
_REMEDY = "Begin anew: dnnvss points MESH --out FOLDER"


def listed() -> dict[str, int]:
    """The points that are set, by name: those of the head's curves, and where each stands in the net."""
    return {n: k for k, n in enumerate(packaged_net().names) if not n.startswith("skin")}


@dataclass(frozen=True)
class _Held:
    """What ``head.json`` holds."""

    mesh: str
    guessed: bool = False
    placed: tuple[str, ...] = ()


@dataclass(frozen=True)
class HeadPoints:
    """The points of a mesh.

    Args:
        folder: that holds them.
        path: of the mesh.
        guessed: whether they began as a guess; else those that were set tell the others.
        placed: the names of those that were set by hand.
        points: places (3,) by name, in the mesh's own space.
    """

    folder: Path
    path: Path
    guessed: bool = False
    placed: tuple[str, ...] = ()
    points: dict[str, np.ndarray] = field(default_factory=dict)

    @classmethod
    def open(cls, folder: Path) -> "HeadPoints":
        """The points in a folder.

        Raises:
            DnnvssError: there are none, or they cannot be read.
        """
        held = read_record(_Held, folder / NAME, _REMEDY)
        if unknown := [name for name in held.placed if name not in listed()]:
            raise DnnvssError(f"no point of the head is named {unknown[0]!r}", file=folder / NAME)
        path = folder / held.mesh
        points = dict[str, np.ndarray]()
        if (folder / POINTS).is_file():
            points = read_points(folder / POINTS, read_mesh(path).mesh, fewest=1)
        return cls(folder, path, held.guessed, held.placed, points)

    def mesh(self) -> Mesh:
        """The mesh as its file has it.

        Raises:
            DnnvssError: it cannot be read, or is no head.
        """
        mesh = read_mesh(self.path).mesh
        check_head(mesh, self.path)
        return mesh

    def save(self) -> None:
        """Write both files."""
        named = {name: [float(f"{x:.6g}") for x in place] for name, place in self.points.items()}
        if named:
            files.write_json(self.folder / POINTS, named)
        held = _Held(str(self.path.resolve()), self.guessed, self.placed)
        files.write_json(self.folder / NAME, asdict(held))

    def moved(self, name: str, place: np.ndarray) -> "HeadPoints":
        """The points with one of them set by hand.

        Points that were guessed go with it where they are near and were not set themselves. Without a guess, the
        others are where a warp of the packaged head puts them, as soon as :data:`FEWEST` were set.

        Raises:
            DnnvssError: no point has this name.
        """
        if name not in listed():
            raise DnnvssError(f"no point of the head is named {name!r}", remedy="Load the page again")
        placed = tuple(dict.fromkeys((*self.placed, name)))
        points = self._carried(name, place) if self.guessed else self._told(placed, name, place)
        return replace(self, placed=placed, points={**points, name: place})

    def _carried(self, name: str, place: np.ndarray) -> dict[str, np.ndarray]:
        rest = packaged_net().at(packaged_head().mesh.vertices)
        rows, step = listed(), place - self.points[name]
        made = {}
        for other, old in self.points.items():
            away = float(np.sqrt(((rest[rows[other]] - rest[rows[name]]) ** 2).sum()))
            share = 0.0 if other in self.placed else np.exp(-((away / _CARRIED) ** 2))
            made[other] = old + share * step
        return made

    def _told(self, placed: tuple[str, ...], name: str, place: np.ndarray) -> dict[str, np.ndarray]:
        own = {n: self.points[n] for n in placed if n in self.points} | {name: place}
        if len(own) < FEWEST:
            return own
        try:
            found = find_points(Mesh(np.eye(3), np.array([[0, 1, 2, 2]])), own)
        except DnnvssError:  # they lie in a plane as yet
            return own
        return {n: found[k] for n, k in listed().items()} | own


def begin(mesh: Path, folder: Path) -> tuple[HeadPoints, str]:
    """Points guessed on a mesh, or none where the guess is refused; and what is to be said of them.

    Raises:
        DnnvssError: the mesh cannot be read, or is no head.
    """
    head = read_mesh(mesh)
    check_head(head.mesh, mesh)
    made = HeadPoints(folder, mesh)
    try:
        found = guess_points(head.mesh)
    except DnnvssError as error:
        made.save()
        return made, f"not guessed: {error.problem}"
    made = replace(made, guessed=True, points={name: found[k] for name, k in listed().items()})
    made.save()
    return made, f"{len(made.points)} points guessed"


def straightened(mesh: Mesh, points: dict[str, np.ndarray]) -> np.ndarray:
    """The turn (3, 3) that brings a mesh upright: by its points where all are known, else by its shape."""
    if len(points) >= len(listed()):
        return upright(find_points(mesh, points))
    return best_turn(mesh)[0]
