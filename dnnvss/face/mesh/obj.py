"""Reads a mesh in Wavefront's OBJ, within bounds."""

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.face.mesh.head import Head
from dnnvss.face.mesh.parts import guessed_part
from dnnvss.face.mesh.surface import MOST_FACES, MOST_VERTICES, Mesh

MOST_BYTES, _MOST_CORNERS = 200_000_000, 1000
_REMEDY = "Export the head alone as OBJ, with its faces, or as .glb with its shape keys"


def read_obj(path: str | Path) -> Head:
    """The faces of an ``.obj`` file as a head without shapes; its curves and materials are left.

    Faces of more than four corners are cut into triangles. Parts are guessed from the names of objects, groups and
    materials.

    Raises:
        DnnvssError: too large, without faces, or a line that cannot be read; names it.
    """
    path = Path(path)
    if path.is_file() and path.stat().st_size > MOST_BYTES:
        raise DnnvssError(
            f"has {path.stat().st_size / 1e6:,.0f} MB, and {MOST_BYTES / 1e6:,.0f} MB are the most",
            file=path,
            remedy=_REMEDY,
        )
    reader = _Lines(path)
    text = files.read_text(path, _REMEDY).replace("\\\n", " ")
    for number, line in enumerate(text.split("\n"), start=1):
        word, _, rest = line.strip().partition(" ")
        if (read := reader.words.get(word)) is not None:
            try:
                read(rest.split())
            except (ValueError, IndexError) as error:
                raise DnnvssError(
                    f"line {number}: {line.strip()[:60]!r} cannot be read",
                    file=path,
                    remedy=_REMEDY,
                ) from error
    return reader.head()


class _Lines:
    """What the lines of a file add up to."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.vertices: list[tuple[float, float, float]] = []
        self.faces: list[tuple[int, ...]] = []
        self.part_of: list[int] = []
        self.parts: dict[str, int] = {}
        self.groups = {"g": "", "o": "", "usemtl": ""}
        named: dict[str, Callable[[list[str]], None]] = {
            word: partial(self._named, word) for word in self.groups
        }
        self.words = {"v": self._vertex, "f": self._face, **named}

    def _vertex(self, rest: list[str]) -> None:
        x, y, z = (float(value) for value in rest[:3])
        self.vertices.append((x, y, z))
        if len(self.vertices) > MOST_VERTICES:
            raise DnnvssError(
                f"has more than {MOST_VERTICES:,} vertices", file=self.path, remedy=_REMEDY
            )

    def _named(self, word: str, rest: list[str]) -> None:
        self.groups[word] = " ".join(rest)

    def _face(self, rest: list[str]) -> None:
        count = len(self.vertices)
        corners = [self._corner(int(cell.partition("/")[0]), count) for cell in rest]
        if not 3 <= len(corners) <= _MOST_CORNERS:
            raise ValueError(f"{len(corners)} corners")
        whole = next((g for g in map(guessed_part, self.groups.values()) if g != "skin"), "skin")
        part = self.parts.setdefault(whole, len(self.parts))
        if len(corners) <= 4:
            made = [(*corners, *corners[-1:] * (4 - len(corners)))]
        else:
            made = [(corners[0], b, c, c) for b, c in pairwise(corners[1:])]
        self.faces += made
        self.part_of += [part] * len(made)
        if len(self.faces) > MOST_FACES:
            raise DnnvssError(f"has more than {MOST_FACES:,} faces", file=self.path, remedy=_REMEDY)

    @staticmethod
    def _corner(number: int, count: int) -> int:
        """The vertex that a number means: from 1, or from the end where it is negative."""
        at = number - 1 if number > 0 else count + number
        if number == 0 or not 0 <= at < count:
            raise ValueError(f"vertex {number} of {count}")
        return at

    def head(self) -> Head:
        if not self.faces:
            raise DnnvssError("holds no faces", file=self.path, remedy=_REMEDY)
        try:
            mesh = Mesh(
                np.array(self.vertices),
                np.array(self.faces),
                tuple(self.parts),
                np.array(self.part_of, np.uint8),
            )
        except DnnvssError as error:
            raise DnnvssError(error.problem, file=self.path, remedy=error.remedy) from error
        return Head(mesh)
