"""Reads the meshes of a glTF file, with the shapes that they have, within bounds; nothing in it is run or followed.

**Source.** Khronos Group, "glTF 2.0 Specification", 2021. Skins, textures and animations are left; a compressed mesh is
refused by the name of what compresses it.
"""

import base64
import binascii
import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.face.mesh.head import Head
from dnnvss.face.mesh.parts import guessed_part
from dnnvss.face.mesh.surface import Mesh, check_size
from dnnvss.face.mesh.weld import weld

MOST_BYTES, _MOST_NODES, _MOST_SHAPES = 400_000_000, 10_000, 1000
_LEAST, _RATIO = 128_000_000, 20
"""Bytes that the shapes of any file may fill, and how many times the bytes that it has."""
_TYPES = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
_WIDTHS = {"SCALAR": 1, "VEC3": 3}
_UNDERSTOOD = ("KHR_materials", "KHR_texture", "KHR_mesh_quantization", "EXT_texture", "KHR_lights")
_REMEDY = "Export it again as glTF 2.0 (.glb) with shape keys, without compression"


def read_gltf(path: str | Path) -> Head:
    """The triangles of a ``.glb`` or ``.gltf`` file as one head, in the scene's coordinates.

    Vertices that the file keeps more than once, for other normals or textures, become one again. Parts are guessed from
    the names of materials and meshes.

    Raises:
        DnnvssError: damaged, too large, compressed, or without triangles.
    """
    path = Path(path)
    if path.is_file() and path.stat().st_size > MOST_BYTES:
        raise DnnvssError(
            f"has {path.stat().st_size / 1e6:,.0f} MB, and {MOST_BYTES / 1e6:,.0f} MB are the most",
            file=path,
            remedy=_REMEDY,
        )
    try:
        found: Head = files.read(path, _read, _REMEDY)
        return found
    except RecursionError as error:
        raise DnnvssError("is nested too deeply", file=path, remedy=_REMEDY) from error


def _read(path: Path) -> Head:
    data = path.read_bytes()
    document, binary = (
        _chunks(data) if data[:4] == b"glTF" else (json.loads(data.decode("utf-8-sig")), None)
    )
    if not isinstance(document, dict):
        raise ValueError("it holds no glTF document")
    for name in document.get("extensionsRequired", []):
        if not str(name).startswith(_UNDERSTOOD):
            raise DnnvssError(f"needs {name}, which is not read here", file=path, remedy=_REMEDY)
    return _Reader(path, document, binary).head()


def _chunks(data: bytes) -> tuple[Any, bytes | None]:
    """The document and the binary chunk of a ``.glb`` file."""
    _, version, whole = struct.unpack_from("<4sII", data)
    if version != 2 or whole > len(data):
        raise ValueError(f"version {version}, {whole} bytes of {len(data)}")
    length, kind = struct.unpack_from("<I4s", data, 12)
    if kind != b"JSON" or 20 + length > len(data):
        raise ValueError("its first chunk is no JSON")
    document, at = json.loads(data[20 : 20 + length]), 20 + length
    if at + 8 > len(data):
        return document, None
    size, kind = struct.unpack_from("<I4s", data, at)
    if kind != b"BIN\0" or at + 8 + size > len(data):
        raise ValueError("its second chunk is cut short")
    return document, data[at + 8 : at + 8 + size]


@dataclass
class _Piece:
    """A primitive: vertices (v, 3), corners (n, 3), the part, names and shapes (s, v, 3)."""

    vertices: np.ndarray
    corners: np.ndarray
    part: str
    names: list[str]
    shapes: np.ndarray


class _Reader:
    """What reads one document; any number out of place is a ``ValueError``, ``KeyError`` or ``IndexError``."""

    def __init__(self, path: Path, document: dict[str, Any], binary: bytes | None) -> None:
        self.path, self.document, self.binary = path, document, binary
        self.kept: dict[str | None, bytes] = {}
        self.vertices = self.corners = 0

    def head(self) -> Head:
        meshes = [(self._item("meshes", index), place) for index, place in self._nodes()]
        found = [(mesh, primitive, place) for mesh, place in meshes for primitive in mesh["primitives"]
                 if primitive.get("mode", 4) == 4]
        counts = [self._item("accessors", each["attributes"]["POSITION"])["count"] for _, each, _ in found]
        check_size(sum(counts))  # told before a vertex is read
        pieces = [self._piece(*each) for each in found]
        if not pieces:
            raise DnnvssError("holds no mesh of triangles", file=self.path, remedy=_REMEDY)
        self._check_shapes(len({name for piece in pieces for name in piece.names}))
        return _joined(pieces)

    def _item(self, kind: str, index: Any) -> dict[str, Any]:
        if not isinstance(index, int) or isinstance(index, bool) or index < 0:
            raise ValueError(f"{kind} has no item {index!r}")
        item = self.document[kind][index]
        if not isinstance(item, dict):
            raise ValueError(f"item {index} of {kind} is no object")
        return item

    def _nodes(self) -> list[tuple[int, np.ndarray]]:
        """The meshes of the scene, each with its place (4, 4) in the world."""
        if "nodes" not in self.document:
            return [
                (k, np.eye(4))
                for k in range(min(len(self.document.get("meshes", [])), _MOST_NODES))
            ]
        scenes = self.document.get("scenes")
        roots = (
            self._item("scenes", self.document.get("scene", 0)).get("nodes", [])
            if scenes
            else range(len(self.document["nodes"]))
        )
        ahead, found = [(k, np.eye(4)) for k in roots], []
        seen: set[int] = set()
        while ahead:
            index, above = ahead.pop()
            if index in seen or len(seen) > _MOST_NODES:
                raise ValueError(f"node {index} comes twice, or there are more than {_MOST_NODES}")
            seen.add(index)
            node = self._item("nodes", index)
            place = above @ _place(node)
            if "mesh" in node:
                found.append((node["mesh"], np.eye(4) if "skin" in node else place))
            ahead += [(k, place) for k in node.get("children", [])]
        return found

    def _piece(self, mesh: dict[str, Any], primitive: dict[str, Any], place: np.ndarray) -> _Piece:
        if "KHR_draco_mesh_compression" in primitive.get("extensions", {}):
            raise DnnvssError("is compressed by Draco", file=self.path, remedy=_REMEDY)
        vertices = self._array(primitive["attributes"]["POSITION"], 3).astype(float)
        self.vertices += len(vertices)
        check_size(self.vertices)
        listed = (
            self._array(primitive["indices"], 1).ravel().astype(np.int64)
            if "indices" in primitive
            else np.arange(len(vertices))
        )
        corners = listed[: len(listed) // 3 * 3].reshape(-1, 3)
        self.corners += len(corners)
        check_size(self.vertices, self.corners)
        if len(corners) and corners.max() >= len(vertices):
            raise ValueError(f"a triangle names vertex {corners.max()} of {len(vertices)}")
        targets = primitive.get("targets", [])
        self._check_shapes(len(targets))
        shapes = np.zeros((len(targets), len(vertices), 3), np.float32)
        for k, target in enumerate(targets):
            if "POSITION" in target:
                moved = self._array(target["POSITION"], 3)
                if len(moved) != len(vertices):
                    raise ValueError(f"shape {k} moves {len(moved)} of {len(vertices)} vertices")
                shapes[k] = moved @ place[:3, :3].T
        names = (mesh.get("extras") or {}).get("targetNames") or []
        named = [
            str(names[k]) if k < len(names) else f"shape{k + 1:02d}" for k in range(len(targets))
        ]
        return _Piece(
            vertices @ place[:3, :3].T + place[:3, 3],
            corners,
            self._part(mesh, primitive),
            named,
            shapes,
        )

    def _check_shapes(self, count: int) -> None:
        """Refuse more shapes of all vertices so far than the file can tell of."""
        told = self.path.stat().st_size + sum(map(len, self.kept.values()))
        if count > _MOST_SHAPES or count * self.vertices * 12 > max(_LEAST, _RATIO * told):
            raise DnnvssError(
                f"has {count} shapes of {self.vertices} vertices, which is too much",
                file=self.path,
                remedy=_REMEDY,
            )

    def _part(self, mesh: dict[str, Any], primitive: dict[str, Any]) -> str:
        material = self._item("materials", primitive["material"]) if "material" in primitive else {}
        name = str(material.get("name", ""))
        part = guessed_part(name)
        return name if name == part or part != "skin" else guessed_part(str(mesh.get("name", "")))

    def _array(self, index: Any, width: int) -> np.ndarray:
        """The numbers (count, width) of an accessor, sparse ones filled in."""
        about = self._item("accessors", index)
        count = about["count"]
        if (
            not isinstance(count, int)
            or not 0 <= count <= MOST_BYTES // 4
            or _WIDTHS[about["type"]] != width
        ):
            raise ValueError(f"accessor {index} holds {count!r} {about['type']}")
        if about.get("normalized") and about["componentType"] != 5126:
            raise ValueError(f"accessor {index} holds quantised numbers")
        check_size(count // 6 if width == 1 else count)
        made = np.zeros((count, width), _TYPES[about["componentType"]])
        if "bufferView" in about:
            made = self._view(
                about["bufferView"], about.get("byteOffset", 0), made.dtype, count, width
            )
        if sparse := about.get("sparse"):
            at = self._view(
                sparse["indices"]["bufferView"],
                sparse["indices"].get("byteOffset", 0),
                np.dtype(_TYPES[sparse["indices"]["componentType"]]),
                sparse["count"],
                1,
            ).ravel()
            made = made.copy()
            made[at] = self._view(
                sparse["values"]["bufferView"],
                sparse["values"].get("byteOffset", 0),
                made.dtype,
                sparse["count"],
                width,
            )
        return made

    def _view(self, index: Any, offset: int, dtype: np.dtype, count: int, width: int) -> np.ndarray:
        view = self._item("bufferViews", index)
        data = self._buffer(view["buffer"])
        start, size, each = view.get("byteOffset", 0), view["byteLength"], dtype.itemsize * width
        stride = view.get("byteStride", each)
        numbers = (offset, count, start, size, stride)
        if (
            not all(isinstance(n, int) and n >= 0 for n in numbers)
            or stride < each
            or start + size > len(data)
        ):
            raise ValueError(f"buffer view {index} lies outside its buffer")
        if count and offset + stride * (count - 1) + each > size:
            raise ValueError(f"an accessor reaches beyond buffer view {index}")
        rows = np.ndarray((count, width), dtype, data, start + offset, (stride, dtype.itemsize))
        return np.array(rows)

    def _buffer(self, index: Any) -> bytes:
        uri = self._item("buffers", index).get("uri")
        if uri not in self.kept:
            self.kept[uri] = self._bytes(uri)
        return self.kept[uri]

    def _bytes(self, uri: str | None) -> bytes:
        """The bytes of a buffer: of the file itself, in its text, or in a file of the same folder."""
        if uri is None:
            if self.binary is None:
                raise ValueError("a buffer has no bytes")
            return self.binary
        if uri.startswith("data:"):
            try:
                return base64.b64decode(uri.partition(",")[2], validate=True)
            except binascii.Error as error:
                raise ValueError("a buffer in the text is damaged") from error
        other = files.inside(self.path.parent, uri)
        if other.is_file() and other.stat().st_size > MOST_BYTES:
            raise DnnvssError("is too large", file=other, remedy=_REMEDY)
        data: bytes = files.read(other, Path.read_bytes, _REMEDY)
        return data


def _place(node: dict[str, Any]) -> np.ndarray:
    """What a node does to what hangs on it (4, 4)."""
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    x, y, z, w = (float(v) for v in node.get("rotation", (0, 0, 0, 1)))
    turned = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    made = np.eye(4)
    made[:3, :3] = turned * np.array(node.get("scale", (1, 1, 1)), float)
    made[:3, 3] = np.array(node.get("translation", (0, 0, 0)), float)
    return made


def _joined(pieces: list[_Piece]) -> Head:
    """All pieces as one head; a shape is named once and moves the vertices of every piece that has it."""
    starts = np.cumsum([0, *(len(p.vertices) for p in pieces)])
    names = list(dict.fromkeys(name for p in pieces for name in p.names))
    parts = list(dict.fromkeys(p.part for p in pieces))
    shapes = np.zeros((len(names), starts[-1], 3), np.float32)
    for piece, start in zip(pieces, starts, strict=False):
        for name, shape in zip(piece.names, piece.shapes, strict=True):
            shapes[names.index(name), start : start + len(shape)] = shape
    corners = np.concatenate([p.corners + start for p, start in zip(pieces, starts, strict=False)])
    part_of = np.repeat(
        [parts.index(p.part) for p in pieces], [len(p.corners) for p in pieces]
    ).astype(np.uint8)
    vertices, shapes, corners, kept = weld(
        np.concatenate([p.vertices for p in pieces]), shapes, corners
    )
    mesh = Mesh(vertices, corners[:, [0, 1, 2, 2]], parts, part_of[kept])
    return Head(mesh, tuple(names), shapes)
