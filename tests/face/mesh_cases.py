"""Small meshes, and files of them."""

from pathlib import Path

import numpy as np

from dnnvss.face.mesh import Head, Mesh, packaged_head


def write_obj(path: Path, head: Head) -> Path:
    """An OBJ file of a head, its parts as groups."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in head.mesh.vertices]
    for part, name in enumerate(head.mesh.parts):
        lines.append(f"g {name}")
        for face in head.mesh.faces[head.mesh.part_of == part]:
            corners = face[:3] if face[2] == face[3] else face
            lines.append("f " + " ".join(f"{c + 1}//{c + 1}" for c in corners))
    path.write_text("\n".join(lines) + "\n")
    return path


def swing(frames: int, *names: str) -> np.ndarray:
    """Weights (F, S) of the packaged head in which some shapes come and go."""
    head = packaged_head()
    weights = np.zeros((frames, len(head.names)))
    for k, name in enumerate(names):
        weights[:, head.position(name)] = 0.5 - 0.5 * np.cos(np.arange(frames) / (4 + k))
    return weights


def tetrahedron() -> Head:
    """Four corners and two shapes."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    faces = np.array([[0, 2, 1, 1], [0, 1, 3, 3], [0, 3, 2, 2], [1, 2, 3, 3]])
    shapes = np.zeros((2, 4, 3), np.float32)
    shapes[0, 1], shapes[1, 2] = [0.5, 0, 0], [0, 0.25, 0]
    return Head(Mesh(vertices, faces), ("wide", "high"), shapes)
