"""The shape of the talker's face: outlines, how the articulators move them, and the landmarks.

Everything is drawn on a design sheet of 320 x 320 units; pictures of another size scale it. The skin moves by a smooth
displacement that is linear in the articulators: the point at ``p`` in the portrait is seen at ``q = p + d(q)``.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np
from scipy.interpolate import CubicSpline

from dnnvss.corpus.talker.targets import Articulators

Points = np.ndarray | Sequence[tuple[float, float]]

SHEET = 320
CENTRE, LIP_LINE, CHIN = 160.0, 212.0, 259.0
JAW_DROP, GAPE = 18.0, 24.0  # units that the chin falls and the inner lips part, at 1
_PIVOT = (CENTRE, 262.0)  # about which the head rolls

def on_sheet(points: Points) -> np.ndarray:
    """Return points (n, 2) that are given about x = 0 on the sheet, where the middle line is at 160."""
    return np.asarray(points, dtype=float) + np.array([CENTRE, 0.0])


JAWLINE = on_sheet([(-75, 158), (-74.5, 172), (-73, 186), (-69.5, 200), (-63, 214), (-54, 228), (-40, 243),
                    (-21, 255.5), (0, CHIN)])  # fmt: skip
"""The left half of the outline from ear to chin, (9, 2); the right half mirrors it."""

_STEPS = 41
_T = np.sin(np.linspace(-np.pi / 2, np.pi / 2, _STEPS))  # across the mouth, -1 and 1 at the corners, denser there
_BOW = CubicSpline([-1, -0.66, -0.25, 0, 0.25, 0.66, 1], [0, 0.66, 1.05, 0.84, 1.05, 0.66, 0], bc_type="natural")(_T)
_PILLOW = CubicSpline([-1, -0.62, -0.25, 0, 0.25, 0.62, 1], [0, 0.62, 0.97, 1, 0.97, 0.62, 0], bc_type="natural")(_T)
_WAVE = 1.0 * np.exp(-((_T / 0.2) ** 2)) - 0.7 * np.exp(-(((np.abs(_T) - 0.42) / 0.2) ** 2))


def mirrored(left: np.ndarray) -> np.ndarray:
    """Return a half outline (n, 2) that ends on the middle line, with its mirror image behind it, (2 n - 1, 2)."""
    right = left[-2::-1] * (-1, 1) + (2 * CENTRE, 0)
    return np.concatenate([left, right])


def mouth_outlines(a: Articulators) -> dict[str, np.ndarray]:
    """Return the four edges of the lips, each (41, 2) from the picture's left to its right, before the head moves.

    Keys: ``upper_outer``, ``upper_inner``, ``lower_inner``, ``lower_outer``. Closed lips share one inner edge.
    """
    gap, press = GAPE * max(a.opening, 0.0), min(max(-a.opening / 0.35, 0.0), 1.0)
    wide = max(a.opening, 0.0)
    line = LIP_LINE + 0.10 * JAW_DROP * a.jaw
    outer = 28.5 + 4.8 * a.spread - 10.0 * a.rounding - 3.5 * a.protrusion - 1.5 * wide
    inner = outer * (0.93 - 0.10 * a.rounding) - 0.8
    corner = line - 1.4 - 1.6 * a.spread + 0.18 * gap + 0.8 * a.rounding
    top, bottom = line - 0.26 * gap - 1.4 * a.tuck, line + 0.74 * gap - 1.4 * a.tuck
    arch = (1 - np.abs(_T) ** (2 + 0.4 * a.rounding)) ** (1 - 0.4 * min(max(a.rounding, 0.0), 1.0))
    wave = _WAVE * max(0.0, 1 - gap / 9)
    common = 1 + 0.22 * a.protrusion - 0.15 * a.spread - 0.10 * wide - 0.42 * press
    upper_lip, lower_lip = 7.8 * (common - 0.10 * a.tuck), 10.4 * (common - 0.52 * a.tuck)
    upper, lower = corner + (top - corner) * arch, corner + (bottom - corner) * arch
    return {
        "upper_outer": np.stack([CENTRE + outer * _T, upper - upper_lip * _BOW], axis=1),
        "upper_inner": np.stack([CENTRE + inner * _T, upper + wave], axis=1),
        "lower_inner": np.stack([CENTRE + inner * _T, lower + wave], axis=1),
        "lower_outer": np.stack([CENTRE + outer * _T, lower + lower_lip * _PILLOW], axis=1),
    }


def _step(value: np.ndarray, start: float | np.ndarray, end: float | np.ndarray) -> np.ndarray:
    s = np.clip((value - start) / (end - start), 0, 1)
    return s * s * (3 - 2 * s)


def _bump(x: np.ndarray, y: np.ndarray, at: tuple[float, float], reach: tuple[float, float]) -> np.ndarray:
    return np.exp(-(((x - at[0]) / reach[0]) ** 2) - ((y - at[1]) / reach[1]) ** 2)


def head_fields(points: np.ndarray) -> np.ndarray:
    """Return displacements (3, N, 2) of ``points`` (N, 2): one unit right, one unit down, one radian clockwise."""
    x, y = points[..., 0], points[..., 1]
    held = (1 - _step(y, 262, 312)) * (1 - _step(np.abs(x - CENTRE), 118, 158)) * _step(y, 0, 14)
    still = np.zeros_like(held)
    turned = np.stack([-(y - _PIVOT[1]) * held, (x - _PIVOT[0]) * held], axis=-1)
    return np.stack([np.stack([held, still], axis=-1), np.stack([still, held], axis=-1), turned])


def skin_fields(points: np.ndarray) -> np.ndarray:
    """Return displacements (5, N, 2) of ``points`` (N, 2) for jaw, spread, rounding, protrusion and tuck at 1."""
    x, y = points[..., 0], points[..., 1]
    side = np.abs(x - CENTRE)
    still = np.zeros_like(x)
    within = 1 - _step(side, 34 - 6 * _step(y, 255, 280), 80 - 34 * _step(y, 225, 285))
    jaw = JAW_DROP * _step(y, 190, 254) * (1 - _step(y, 280, 317)) * within
    left, right = (_bump(x, y, (CENTRE + s * 33, 211), (13, 17)) for s in (-1, 1))
    cheeks = sum(_bump(x, y, (CENTRE + s * 40, 196), (17, 15)) for s in (-1, 1))
    pout = _bump(x, y, (CENTRE, 200), (22, 9))
    boss = _bump(x, y, (CENTRE, 240), (20, 11))
    return np.stack([
        np.stack([still, jaw], axis=-1),
        np.stack([3.2 * (right - left), -1.6 * cheeks], axis=-1),
        np.stack([-4.5 * (right - left), still], axis=-1),
        np.stack([-1.5 * (right - left), -0.8 * pout], axis=-1),
        np.stack([still, -2.2 * boss], axis=-1),
    ])  # fmt: skip


SKIN_FROM = 160.0
"""Above this line nothing moves the skin (less than 0.02 units)."""


def field_weights(rows: np.ndarray) -> np.ndarray:
    """Return what the fields of head and skin are multiplied by, (F, 8), for articulators ``rows`` (F, 12).

    Head: units right and down, and radians; skin: jaw, spread, rounding, protrusion, tuck.
    """
    names = Articulators._fields
    columns = {name: rows[:, names.index(name)] for name in names}
    head = [columns["sway_x"] * SHEET / 1000, columns["sway_y"] * SHEET / 1000, np.radians(columns["roll"])]
    skin = [columns[name] for name in ("jaw", "spread", "rounding", "protrusion", "tuck")]
    return np.stack([*head, *skin], axis=1)


def moved(points: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return where ``points`` (N, 2) of the portrait are seen in each frame of ``rows`` (F, 12), shape (F, N, 2)."""
    weights = field_weights(rows)
    seen = np.repeat(points[None], len(rows), axis=0)
    for _ in range(12):  # q = p + d(q); where there are points, d changes by less than half a unit a unit
        fields = np.concatenate([head_fields(seen), skin_fields(seen)])
        seen = points + np.einsum("fk,kfnc->fnc", weights, fields)
    return seen


def head_turn(a: Articulators) -> tuple[np.ndarray, np.ndarray]:
    """Return matrix (2, 2) and offset (2,) by which the head carries points between brow and chin, where it is rigid.

    A point at ``p`` is seen at ``p @ matrix + offset``, which solves ``q = p + d(q)``.
    """
    angle = np.radians(a.roll)
    matrix = np.array([[1.0, angle], [-angle, 1.0]]) / (1 + angle * angle)
    shift = np.array([a.sway_x, a.sway_y]) * SHEET / 1000 - _PIVOT
    return matrix, shift @ matrix + _PIVOT


def carried(points: np.ndarray, a: Articulators) -> np.ndarray:
    """Return where ``points`` (..., 2) are seen that only the head carries, as :func:`head_turn` has it."""
    matrix, offset = head_turn(a)
    return points @ matrix + offset


NOSE_BASE = on_sheet([(-15, 182), (-7.5, 187), (0, 189), (7.5, 187), (15, 182)])
NOSE_BRIDGE = on_sheet([(0, 133), (0, 146), (0, 159), (0, 173)])
EYE = np.array([(-17.5, 139.5), (-11, 131), (0, 127), (11, 130.5), (16.5, 141), (0, 149)])  # about x = 0; static rims
EYE_AT = 35.0
BROW = np.array([(-22, 116.5), (-12, 109.5), (0, 107.5), (11, 109.5), (18, 113.5)])

LANDMARK_COUNTS = {"jaw": 15, "lips_outer": 20, "lips_inner": 16, "nose_base": 5, "nose_bridge": 4, "right_eye": 6,
                   "left_eye": 6, "right_brow": 5, "left_brow": 5}  # fmt: skip
_ENDS = np.cumsum([0, *LANDMARK_COUNTS.values()])
LANDMARK_GROUPS: dict[str, tuple[int, int]] = {
    name: (int(start), int(end)) for name, start, end in zip(LANDMARK_COUNTS, _ENDS[:-1], _ENDS[1:], strict=True)
}
"""Rows of each group among the landmarks; right and left are the talker's own."""


@cache
def _portrait_points() -> dict[str, np.ndarray]:
    """Return the landmarks that skin and head carry, on the portrait."""
    outline = mirrored(JAWLINE)
    along = np.linspace(0, len(outline) - 1, LANDMARK_COUNTS["jaw"])
    jaw = CubicSpline(np.arange(len(outline)), outline)(along)
    at, flip = np.array([CENTRE - EYE_AT, 0]), np.array([-1, 1])
    pairs = {"right_eye": EYE + at, "right_brow": BROW + at}
    mirror = np.array([2 * CENTRE, 0])
    pairs |= {name.replace("right", "left"): p * flip + mirror for name, p in pairs.items()}
    return {"jaw": jaw, "nose_base": NOSE_BASE, "nose_bridge": NOSE_BRIDGE, **pairs}


def _picks(count: int) -> np.ndarray:
    """Return positions among the 41 steps of a lip edge, evenly spread across the mouth."""
    return np.abs(_T - np.linspace(-1, 1, count)[:, None]).argmin(axis=1)


def landmarks(articulators: Articulators, size: int = SHEET) -> np.ndarray:
    """Return the true landmarks (82, 2) in pixels of a picture of ``size``, rows as in :data:`LANDMARK_GROUPS`."""
    return landmark_track(np.array([articulators]), size)[0]


def landmark_track(rows: np.ndarray, size: int = SHEET) -> np.ndarray:
    """Return the true landmarks of every frame (F, 82, 2) in pixels, for articulators ``rows`` (F, 12)."""
    still = _portrait_points()
    ends = np.cumsum([len(points) for points in still.values()])[:-1]
    parts = dict(zip(still, np.split(moved(np.concatenate(list(still.values())), rows), ends, axis=1), strict=True))
    lips = [_lip_points(Articulators(*row)) for row in rows]
    parts |= {name: np.stack([frame[name] for frame in lips]) for name in lips[0]}
    return np.concatenate([parts[name] for name in LANDMARK_GROUPS], axis=1) * (size / SHEET)


def _lip_points(a: Articulators) -> dict[str, np.ndarray]:
    """Return the landmarks of both lip edges, each from one corner over the upper lip and back under the lower."""
    edges, points = mouth_outlines(a), {}
    for name in ("outer", "inner"):
        steps = _picks(LANDMARK_COUNTS[f"lips_{name}"] // 2 + 1)
        edge = np.concatenate([edges[f"upper_{name}"][steps], edges[f"lower_{name}"][steps[-2:0:-1]]])
        points[f"lips_{name}"] = carried(edge, a)
    return points
