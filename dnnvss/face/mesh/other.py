"""Heads from files, made ready to be moved by the packaged head's shapes."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.face.mesh.gltf_read import read_gltf
from dnnvss.face.mesh.guess import turned, upright
from dnnvss.face.mesh.head import Head, packaged_head
from dnnvss.face.mesh.obj import read_obj
from dnnvss.face.mesh.surface import LARGEST, Mesh
from dnnvss.face.mesh.transfer import find_points, transfer_to, with_shapes

_OWN = 10
"""Shapes named as the packaged head's that a file needs so that its own are taken."""
_FEWEST, _FLAT = 50, 0.01
"""Vertices of a mesh, and the share of its longest side that the shortest has, below which it is no head."""
_MOST = 60_000
"""Vertices of a mesh to which 52 shapes are given."""
_READERS: dict[str, Callable[[Path], Head]] = {".obj": read_obj, ".glb": read_gltf, ".gltf": read_gltf}
_REMEDY = 'Write {"nose_bridge07": 123, "lips_outer01": [x, y, z], ...}: six points or more'


def read_mesh(path: Path) -> Head:
    """The head in an ``.obj``, ``.glb`` or ``.gltf`` file, its faces outward.

    Raises:
        DnnvssError: another kind of file, or one that cannot be read.
    """
    read = _READERS.get(path.suffix.lower())
    if read is None:
        raise DnnvssError(
            f"a mesh is not read from {path.suffix or 'a folder'}",
            file=path,
            remedy="Export it as .obj, .glb or .gltf",
        )
    head = read(path)
    return replace(head, mesh=head.mesh.outward)


def open_head(path: Path, points: Path | None = None) -> tuple[Head, str]:
    """A head with shapes, and what is to be said of where they come from.

    A mesh that has shapes of ARKit's names keeps its own; others get those of the packaged head, and are turned so that
    y is up and the face looks along z.

    Args:
        path: the mesh.
        points: JSON of some of its points by name; they are guessed where None.

    Raises:
        DnnvssError: a file that cannot be read, a mesh too large, or points that do not fit.
    """
    head = read_mesh(path)
    known = {name.lower() for name in packaged_head().names}
    own = sum(name.lower() in known for name in head.names)
    if own >= _OWN and points is None:
        return head, f"{path}: {own} shapes of its own"
    check_head(head.mesh, path)
    try:
        found = find_points(head.mesh, read_points(points, head.mesh) if points else None)
        turn = upright(found)
        mesh = turned(head.mesh, turn)
        made = with_shapes(mesh, transfer_to(mesh, found @ turn.T))
    except DnnvssError as error:
        raise DnnvssError(error.problem, file=points or path, remedy=error.remedy) from error
    except (ValueError, IndexError, ArithmeticError, np.linalg.LinAlgError) as error:
        raise DnnvssError(
            f"the head cannot be laid onto this mesh ({error})", file=points or path, remedy=_REMEDY
        ) from error
    how = f"points of {points}" if points else "points guessed"
    how += "" if mesh is head.mesh else "; turned upright, to look along z"
    return made, f"{path}: {len(made.names)} shapes of the packaged head, {how}"


def check_head(mesh: Mesh, path: Path) -> None:
    """Refuse a mesh that shapes cannot be made for.

    Raises:
        DnnvssError: too many vertices, or too few and flat.
    """
    if len(mesh.vertices) > _MOST:
        raise DnnvssError(
            f"has {len(mesh.vertices):,} vertices, and {_MOST:,} are the most that shapes are made for",
            file=path,
            remedy="Reduce it, or give it ARKit's shapes in your own tool",
        )
    if fault := _no_head(mesh):
        raise DnnvssError(fault, file=path, remedy="Export the whole head")


def _no_head(mesh: Mesh) -> str | None:
    """What keeps a mesh from being a head, None where nothing does."""
    if len(mesh.vertices) < _FEWEST:
        return f"has {len(mesh.vertices)} vertices, which make no head"
    sides = np.ptp(mesh.vertices, axis=0)
    if not sides.min() > _FLAT * sides.max():
        return f"is flat: {' x '.join(f'{side:g}' for side in sides)}"
    return None


def read_points(path: Path, mesh: Mesh, fewest: int = 6) -> dict[str, np.ndarray]:
    """Places (3,) of points by name: each a vertex's number or three coordinates.

    Args:
        path: of the JSON.
        mesh: whose vertices are numbered.
        fewest: how many there have to be.

    Raises:
        DnnvssError: no such file, or a value that is neither.
    """
    held = files.read_json(path, _REMEDY)
    if not isinstance(held, dict) or not fewest <= len(held) <= 1000:
        raise DnnvssError("holds no six points by name", file=path, remedy=_REMEDY)
    return {name: _place(name, value, mesh, path) for name, value in held.items()}


def _place(name: str, value: object, mesh: Mesh, path: Path) -> np.ndarray:
    if isinstance(value, int) and not isinstance(value, bool) and 0 <= value < len(mesh.vertices):
        return np.asarray(mesh.vertices[value])
    if (
        isinstance(value, list)
        and len(value) == 3
        and all(type(v) in (int, float) and abs(v) <= LARGEST for v in value)
    ):
        place = np.array(value, float)
        if np.isfinite(place).all():
            return place
    raise DnnvssError(
        f"{name} is {value!r}, no vertex of {len(mesh.vertices)} and no place",
        file=path,
        remedy=_REMEDY,
    )
