"""Writes a head and its movement as binary glTF, which Blender, three.js and game engines open.

**Source.** Khronos Group, "glTF 2.0 Specification", 2021. Names of the shapes stand in ``mesh.extras.targetNames``,
where those programs look for them.
"""

import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.face.mesh.head import Head
from dnnvss.face.mesh.parts import part_colour
from dnnvss.face.mesh.turns import Turns

_FLOAT, _SHORT, _INT = 5126, 5123, 5125
_VERTICES, _INDICES = 34962, 34963
MOST_BYTES = 1_000_000_000
"""Of a file; what would be larger is refused before it is made."""


@dataclass
class _Buffer:
    """The bytes of a file and what its accessors say of them."""

    parts: list[bytes] = field(default_factory=list)
    views: list[dict[str, Any]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)
    size: int = 0

    def add(self, array: np.ndarray, kind: str, target: int | None = None) -> int:
        """The number of a new accessor of an array."""
        data = np.ascontiguousarray(array).tobytes()
        code = {"float32": _FLOAT, "uint16": _SHORT, "uint32": _INT}[array.dtype.name]
        view = {"buffer": 0, "byteOffset": self.size, "byteLength": len(data)}
        self.views.append(view | ({"target": target} if target else {}))
        about: dict[str, Any] = {
            "bufferView": len(self.views) - 1,
            "componentType": code,
            "type": kind,
            "count": len(array),
        }
        if code == _FLOAT:
            ends = array.reshape(len(array), -1)
            about |= {"min": ends.min(axis=0).tolist(), "max": ends.max(axis=0).tolist()}
        self.accessors.append(about)
        padded = data + b"\0" * (-len(data) % 4)
        self.parts.append(padded)
        self.size += len(padded)
        return len(self.accessors) - 1


def write_glb(
    path: Path,
    head: Head,
    weights: np.ndarray | None = None,
    times: np.ndarray | None = None,
    about: dict[str, Any] | None = None,
    turns: Turns | None = None,
) -> Path:
    """Write a head with its shapes, and one animation of their weights, as ``.glb``; return the path.

    Args:
        path: the file.
        head: the mesh and its shapes.
        weights: of the shapes (F, S); no animation where None.
        times: seconds (F,) of the frames, rising.
        about: kept in ``asset.extras``, such as the time code of the first frame.
        turns: of the whole head in these frames: a node ``neck`` that turns; none where None.

    Raises:
        DnnvssError: the file would be larger than :data:`MOST_BYTES`.
    """
    shapes, vertices = len(head.names), len(head.mesh.vertices)
    frames = 0 if weights is None else len(weights)
    if (needed := 12 * vertices * (shapes + 2) + 4 * frames * (shapes + 1)) > MOST_BYTES:
        raise DnnvssError(
            f"{vertices:,} vertices with {shapes} shapes and {frames} frames would fill "
            f"{needed / 1e6:,.0f} MB",
            file=path,
            remedy="Take a mesh of fewer vertices, or fewer frames",
        )
    buffer = _Buffer()
    document = _document(head, buffer, about or {})
    if weights is not None and times is not None and len(times):
        document["animations"] = [_animation(weights, times, buffer)]
        if turns is not None:
            _turn(document, turns, buffer)
    document |= {
        "bufferViews": buffer.views,
        "accessors": buffer.accessors,
        "buffers": [{"byteLength": buffer.size}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    whole = 12 + 8 + len(text) + 8 + buffer.size
    with files.replacing(path) as temporary, temporary.open("wb") as out:
        out.write(
            struct.pack("<4sII", b"glTF", 2, whole) + struct.pack("<I4s", len(text), b"JSON") + text
        )
        out.write(struct.pack("<I4s", buffer.size, b"BIN\0"))
        out.writelines(buffer.parts)
    return path


def _document(head: Head, buffer: _Buffer, about: dict[str, Any]) -> dict[str, Any]:
    mesh = head.mesh
    attributes = {
        "POSITION": buffer.add(mesh.vertices.astype(np.float32), "VEC3", _VERTICES),
        "NORMAL": buffer.add(_unit(mesh.normals()), "VEC3", _VERTICES),
    }
    targets = [
        {"POSITION": buffer.add(shape.astype(np.float32), "VEC3", _VERTICES)}
        for shape in head.shapes
    ]
    small = np.uint16 if len(mesh.vertices) < 65535 else np.uint32
    primitives: list[dict[str, Any]] = []
    materials: list[dict[str, Any]] = []
    for part, name in enumerate(mesh.parts):
        corners = mesh.triangles[mesh.triangle_parts == part]
        if len(corners):
            indices = buffer.add(corners.astype(small).ravel(), "SCALAR", _INDICES)
            primitive: dict[str, Any] = {
                "attributes": attributes,
                "indices": indices,
                "material": len(materials),
            }
            primitives.append(primitive | ({"targets": targets} if targets else {}))
            materials.append(_material(name))
    made: dict[str, Any] = {"name": "head", "primitives": primitives}
    if targets:
        made |= {"weights": [0.0] * len(targets), "extras": {"targetNames": list(head.names)}}
    return {
        "asset": {"version": "2.0", "generator": "dnnvss"} | ({"extras": about} if about else {}),
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "head", "mesh": 0}],
        "meshes": [made],
        "materials": materials,
    }


def _unit(normals: np.ndarray) -> np.ndarray:
    """Normals of length 1 as float32, forward where a vertex has none."""
    made = normals.copy()
    made[(made**2).sum(axis=1) < 0.5] = [0.0, 0.0, 1.0]
    return (made / np.sqrt((made**2).sum(axis=1, keepdims=True))).astype(np.float32)


def _material(name: str) -> dict[str, Any]:
    linear = ((np.array(part_colour(name)) / 255) ** 2.2).round(4).tolist()
    return {
        "name": name,
        "doubleSided": name in ("mouth", "socket"),
        "pbrMetallicRoughness": {
            "baseColorFactor": [*linear, 1.0],
            "metallicFactor": 0.0,
            "roughnessFactor": 0.7,
        },
    }


def _animation(weights: np.ndarray, times: np.ndarray, buffer: _Buffer) -> dict[str, Any]:
    inputs = buffer.add(times.astype(np.float32), "SCALAR")
    outputs = buffer.add(weights.astype(np.float32).ravel(), "SCALAR")
    return {
        "name": "speech",
        "samplers": [{"input": inputs, "output": outputs, "interpolation": "LINEAR"}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}],
    }


def _turn(document: dict[str, Any], turns: Turns, buffer: _Buffer) -> None:
    """Hang the head on a node in its neck, and turn that in the animation."""
    pivot, animation = turns.pivot.tolist(), document["animations"][0]
    document["nodes"][0]["translation"] = [-value for value in pivot]
    document["nodes"].append({"name": "neck", "translation": pivot, "children": [0]})
    document["scenes"] = [{"nodes": [1]}]
    outputs = buffer.add(turns.quaternions.astype(np.float32), "VEC4")
    first = animation["samplers"][0]
    animation["samplers"].append(first | {"output": outputs})
    animation["channels"].append({"sampler": 1, "target": {"node": 1, "path": "rotation"}})
