"""Places on the source of the packaged head that its files do not name: the face's oval, irises, lines by position."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dnnvss.face.mesh.surface import Mesh

_CENTRE, _ANGLES, _TURNED = (0.0, 6.95), 36, 0.35
"""The middle of the face, directions of its oval, and how much the skin still looks forward there."""
_EARS, _BACK, _HAIR, _NEAR = 0.72, 0.75, 7.75, 0.5
"""Decimetres: width without ears, depth in front of which the oval lies, height of the hair line, and how far from the
middle it lies at least."""
_SIDES, _PUPIL, _IRIS, _LIFT = 16, np.deg2rad(9), np.deg2rad(25), 1.02
"""Corners of a disc, half angles that pupil and iris fill of the eye, and their radius over the eye's."""


def near(vertices: np.ndarray, among: np.ndarray, line: Sequence[tuple[float, float]]) -> list[int]:
    """The vertices that lie nearest to places (x, y) as seen from the front."""
    away = ((vertices[among][None, :, :2] - np.array(line)[:, None]) ** 2).sum(axis=2)
    return list(dict.fromkeys(among[away.argmin(axis=1)].tolist()))


def face_oval(mesh: Mesh, skin: np.ndarray) -> list[int]:
    """Vertices round the face where the skin turns to the side, clockwise from the top as seen from the front."""
    v, n = mesh.vertices[skin], mesh.normals()[skin]
    fit = (np.abs(v[:, 0]) < _EARS) & (v[:, 2] > _BACK) & (v[:, 1] < _HAIR) & (n[:, 2] > 0)
    away = v[:, :2] - _CENTRE
    fit &= np.hypot(*away.T) > _NEAR
    outward = (n[:, :2] * away).sum(axis=1) > 0
    angle = np.arctan2(away[:, 0], away[:, 1])
    found = []
    for at in np.arange(_ANGLES) * 2 * np.pi / _ANGLES:
        turn = np.abs((angle - at + np.pi) % (2 * np.pi) - np.pi)
        cost = np.abs(n[:, 2] - _TURNED) + 3 * turn + 10 * ~(fit & outward)
        found.append(int(skin[cost.argmin()]))
    return list(dict.fromkeys(found))


@dataclass(frozen=True)
class Disc:
    """Iris and pupil of an eye: vertices (n, 3), faces (m, 4), their parts, and how shapes move them (S, n, 3)."""

    vertices: np.ndarray
    faces: np.ndarray
    parts: list[str]
    moved: np.ndarray


def eye_discs(vertices: np.ndarray, eye: np.ndarray, moved: np.ndarray) -> Disc:
    """Iris and pupil in front of an eyeball, which turn with it.

    Args:
        vertices: of the head (V, 3).
        eye: those of the eyeball.
        moved: how shapes move the head (S, V, 3).
    """
    ball = vertices[eye]
    centre = (ball.min(axis=0) + ball.max(axis=0)) / 2
    radius = _LIFT * np.ptp(ball, axis=0).max() / 2
    turn = np.arange(_SIDES) * 2 * np.pi / _SIDES
    rings = [
        np.stack(
            [np.sin(a) * np.cos(turn), np.sin(a) * np.sin(turn), np.full(_SIDES, np.cos(a))], axis=1
        )
        for a in (_PUPIL, _IRIS)
    ]
    made = centre + radius * np.concatenate([[[0.0, 0.0, 1.0]], *rings])
    k = np.arange(_SIDES)
    after = (k + 1) % _SIDES
    pupil = np.stack([np.zeros_like(k), 1 + k, 1 + after, 1 + after], axis=1)
    iris = np.stack([1 + k, 1 + _SIDES + k, 1 + _SIDES + after, 1 + after], axis=1)
    whole = np.column_stack([ball, np.ones(len(ball))])
    ours = np.column_stack([made, np.ones(len(made))])
    turned = np.stack([ours @ np.linalg.lstsq(whole, shape[eye], rcond=None)[0] for shape in moved])
    return Disc(made, np.concatenate([pupil, iris]), ["pupil"] * _SIDES + ["iris"] * _SIDES, turned)
