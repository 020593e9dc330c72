"""A mesh that follows a surface of Bezier triangles over control points.

Each vertex is bound to the nearest place on the surface whose normal is within an angle of its own,
and keeps its offset in the frame of normal and slope there: ``V = B(u, v) + d n(u, v)`` (equation
3), with what is left along the surface. The angle keeps the lips apart without masks. Vertices that
no place suits follow their neighbours along the edges of the mesh.

**Source.** J. D. Edge, M. A. Sanchez, S. Maddock, 2004, section 6; the masks it replaces are those of M. A. Sanchez et
al., "Realistic performance-driven facial animation using hardware acceleration", 2003.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu
from scipy.spatial import cKDTree

from dnnvss.face.mesh.bezier import BezierSurface, _cross, _unit
from dnnvss.face.mesh.surface import Mesh

ANGLE = 60.0
"""Degrees between the normals of a vertex and of its place, at most."""
_GRID, _TRIED = 8, 40
_FAR = 1.6
"""Usual distances between control points, beyond which a vertex is not bound."""
_FADE = 2e-3
"""How fast movement fades along the mesh behind the surface's border."""
LOOSE = ("eye", "iris", "pupil", "upper_teeth", "lower_teeth", "tongue")
"""Parts that the skin does not carry."""


@dataclass(frozen=True)
class Deformer:
    """A mesh bound to a surface.

    Args:
        mesh: at rest.
        surface: over the control points.
        bound: vertices (n,) that follow places on the surface.
        offsets: (n, 3) of them along slope, side and normal.
        matrices: what makes places, slopes and normals of the control points.
        follow: vertices (m,) that follow their neighbours.
        pull: what bound vertices add to them (m, n).
        solver: of the system of those vertices; None where there are none.
    """

    mesh: Mesh
    surface: BezierSurface
    bound: np.ndarray
    offsets: np.ndarray
    matrices: tuple[sparse.csr_array, ...]
    follow: np.ndarray
    pull: sparse.csr_array
    solver: SuperLU | None

    def vertices(self, points: np.ndarray) -> np.ndarray:
        """Vertices (V, 3) for control points (P, 3)."""
        made = self.mesh.vertices.copy()
        place, frame = _places(self.surface, self.matrices, points)
        made[self.bound] = place + np.einsum("nk,knd->nd", self.offsets, frame)
        if self.solver is not None:
            moved = made[self.bound] - self.mesh.vertices[self.bound]
            made[self.follow] += self.solver.solve(self.pull @ moved)
        return made


def bind(mesh: Mesh, surface: BezierSurface, points: np.ndarray, angle: float = ANGLE) -> Deformer:
    """A mesh bound to a surface over control points.

    Args:
        mesh: at rest.
        surface: triangles over the control points.
        points: (P, 3) at rest.
        angle: degrees between normals, at most.
    """
    grid = _grid()
    triangle = np.repeat(np.arange(len(surface.triangles)), len(grid))
    at = np.tile(grid, (len(surface.triangles), 1))
    samples, frames = _places(surface, surface.weights(triangle, at), points)
    choice = _nearest(mesh, samples, frames[2], points, angle)
    bound = np.flatnonzero(choice >= 0)
    matrices = surface.weights(triangle[choice[bound]], at[choice[bound]])
    place, frame = _places(surface, matrices, points)
    offsets = np.einsum("nd,knd->nk", mesh.vertices[bound] - place, frame)
    follow, pull, solver = _followers(mesh, bound)
    return Deformer(mesh, surface, bound, offsets, matrices, follow, pull, solver)


def _grid() -> np.ndarray:
    steps = np.array([(i, j) for i in range(_GRID + 1) for j in range(_GRID + 1 - i)]) / _GRID
    return np.column_stack([1 - steps.sum(axis=1), steps])


def _places(
    surface: BezierSurface, matrices: tuple[sparse.csr_array, ...], points: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 3) and their frames (3, n, 3): slope, side and normal."""
    controls, normals = surface.controls(points)
    cubic, slope, quadratic = matrices
    flat = controls.reshape(-1, 3)
    normal = _unit(quadratic @ normals.reshape(-1, 3))
    along = slope @ flat
    along = _unit(along - (along * normal).sum(axis=1, keepdims=True) * normal)
    return cubic @ flat, np.stack([along, _cross(normal, along), normal])


def _nearest(
    mesh: Mesh, samples: np.ndarray, normals: np.ndarray, points: np.ndarray, angle: float
) -> np.ndarray:
    """The sample (V,) that each vertex is bound to, -1 for none."""
    usual = float(np.median(cKDTree(points).query(points, k=2)[0][:, 1]))
    away, found = cKDTree(samples).query(
        mesh.vertices, k=min(_TRIED, len(samples)), distance_upper_bound=_FAR * usual
    )
    inside = np.isfinite(away)
    found = np.where(inside, found, 0)
    facing = np.einsum("vkd,vd->vk", normals[found], mesh.normals())
    fits = inside & (facing >= np.cos(np.deg2rad(angle)))
    best = fits.argmax(axis=1)
    choice = np.where(fits.any(axis=1), found[np.arange(len(found)), best], -1)
    for part in LOOSE:
        choice[mesh.of_part(part)] = -1
    return choice


def _followers(
    mesh: Mesh, bound: np.ndarray
) -> tuple[np.ndarray, sparse.csr_array, SuperLU | None]:
    """Vertices that follow, what bound ones add to them, and the solver of the membrane between."""
    size = len(mesh.vertices)
    first, second = mesh.edges.T
    ones = np.ones(len(first))
    joined = sparse.csr_array(
        (np.tile(ones, 2), (np.r_[first, second], np.r_[second, first])), shape=(size, size)
    )
    loose = np.unique(np.concatenate([mesh.of_part(part) for part in LOOSE]))
    follow = np.setdiff1d(np.arange(size), np.concatenate([bound, loose]))
    if not len(follow):
        return follow, sparse.csr_array((0, len(bound))), None
    rows = joined[follow]
    degree = np.asarray(rows.sum(axis=1)).ravel()
    system = sparse.diags_array(degree * (1 + _FADE) + 1e-9) - rows[:, follow]
    return follow, sparse.csr_array(rows[:, bound]), splu(sparse.csc_matrix(system))
