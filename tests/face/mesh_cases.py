"""Small meshes, files of them, and a head from elsewhere."""

from collections.abc import Callable
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


def foreign_head(seed: int = 0, parts: bool = True) -> tuple[Mesh, Callable[[np.ndarray], np.ndarray]]:
    """Another face made of other vertices in centimetres, z up and looking along -y; and what takes places to it."""
    head = packaged_head()

    def there(v: np.ndarray) -> np.ndarray:
        other = v * [1.1, 0.95, 1.04] + 0.003 * np.sin(v[:, [1, 2, 0]] * 27 + seed)
        return 100 * np.stack([other[:, 0], -other[:, 2], other[:, 1]], axis=1) + [4, -7, 160]

    vertices, faces, part_of = _remeshed(head.mesh, seed)
    if not parts:
        return Mesh(there(vertices), faces), there
    return Mesh(there(vertices), faces, head.mesh.parts, part_of), there


def _remeshed(mesh: Mesh, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, faces and their parts: each quadrangle cut about its middle, then edges taken out as chance has it."""
    f = mesh.faces
    middles = len(mesh.vertices) + np.arange(len(f))
    vertices = np.concatenate([mesh.vertices, mesh.vertices[f].mean(axis=1)])
    triangles = np.concatenate([np.stack([f[:, k], f[:, (k + 1) % 4], middles], 1) for k in range(4)])
    part_of = np.tile(mesh.part_of, 4)
    whole = triangles[:, 0] != triangles[:, 1]
    triangles, part_of = triangles[whole], part_of[whole]
    sides = np.sort(np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
    edges, often = np.unique(sides, axis=0, return_counts=True)
    near: list[set[int]] = [set() for _ in vertices]
    for a, b in edges.tolist():
        near[a].add(b)
        near[b].add(a)
    held, goes = np.zeros(len(vertices), bool), np.arange(len(vertices))
    held[edges[often == 1]] = True
    for part in range(len(mesh.parts)):
        held |= np.isin(goes, triangles[part_of == part]) & np.isin(goes, triangles[part_of != part])
    for a, b in np.random.default_rng(seed).permutation(edges).tolist():
        if not (held[a] or held[b]) and len(near[a] & near[b]) == 2:
            vertices[a], goes[b] = (vertices[a] + vertices[b]) / 2, a
            held[[a, b, *near[a], *near[b]]] = True
    triangles = goes[triangles]
    kept = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    used, faces = np.unique(triangles[kept], return_inverse=True)
    faces = faces.reshape(-1, 3)
    return vertices[used], faces[:, [0, 1, 2, 2]], part_of[kept]
