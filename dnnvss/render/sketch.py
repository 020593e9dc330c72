"""A face of points as a clean drawing: lips, eyes, brows and jaw as smooth lines over a thin mesh."""

from collections.abc import Iterator
from functools import cached_property

import cv2
import numpy as np

from dnnvss.face.lips import lip_pairs, parted
from dnnvss.face.points import PointsFace
from dnnvss.render.renderer import check_scale
from dnnvss.render.strokes import Stroke, strokes_of

HEIGHT = 480
"""Pixels of a drawing at scale 1."""
_TURN = np.deg2rad(18)
"""By which faces in space are turned, so that their depth is seen."""
_ROOM = 0.08
"""Room round the face, as a share of its height."""
_REACH = 3.0
"""Standard deviations of each parameter within which the face stays in the picture."""
_FINE = 2
"""Drawn pixels for each pixel of the picture, along each axis."""
_SHIFT = 4

_GROUND, _SKIN, _MESH = (250, 248, 245), (243, 227, 214), (226, 205, 189)
_LIPS, _LIP_LINE, _MOUTH = (214, 124, 122), (160, 70, 76), (86, 34, 40)
_EYE, _IRIS, _LINE, _BROW, _DOT = (255, 255, 255), (148, 160, 168), (134, 108, 96), (150, 120, 104), (38, 70, 108)
_IRIS_SIZE = 0.2
"""Radius of an iris, as a share of the eye's width."""


class Sketch:
    """Draws a face of points from the front, in space a little turned; pictures are orthographic.

    Landmarks that are not modelled are drawn where they usually are (:meth:`PointsFace.whole`). Lips that would pass
    through each other meet half way.

    Args:
        face: the face.
        scale: size of the pictures over :data:`HEIGHT`.

    Raises:
        DnnvssError: the scale is not positive.
    """

    views = ("face", "mesh")

    def __init__(self, face: PointsFace, scale: float = 1.0) -> None:
        check_scale(scale)
        self.face = face
        low, high = self._extent()
        height = HEIGHT * scale
        self._zoom = height * (1 - 2 * _ROOM) / (high[1] - low[1])
        room = height * _ROOM
        width = (high[0] - low[0]) * self._zoom + 2 * room
        self.size: tuple[int, int] = (2 * round(width / 2), 2 * round(height / 2))
        self._origin = low - room / self._zoom

    def _extent(self) -> tuple[np.ndarray, np.ndarray]:
        """The corners of what the face may reach, before the zoom."""
        reach = _REACH * np.diag(self.face.deviations)
        shapes = _flat(self.face.whole(np.concatenate([np.zeros((1, len(reach))), reach, -reach])))
        rest = shapes[0]
        low, high = np.minimum(shapes.min(axis=(0, 1)), rest.min(axis=0)), shapes.max(axis=(0, 1))
        return low, np.maximum(high, low + 1e-6 + 1e-3 * np.ptp(rest))

    def points_in_image(self, parameters: np.ndarray) -> np.ndarray:
        """The face's points (..., P, 2) in pixels of the pictures, for parameters (..., D)."""
        return self._whole(parameters)[..., self.face.layout.rows, :]

    def _whole(self, parameters: np.ndarray) -> np.ndarray:
        shapes = (_flat(self.face.whole(np.asarray(parameters, dtype=float))) - self._origin) * self._zoom
        return parted(shapes, self._lips)

    @cached_property
    def _lips(self) -> np.ndarray:
        """Pairs (n, 2) of landmarks of the inner lips, upper and lower."""
        start, stop = self.face.landmark_groups[self.face.settings.points.lips_inner]
        return lip_pairs(_flat(self.face.whole_mean), np.arange(start, stop))[0]

    @cached_property
    def _strokes(self) -> list[Stroke]:
        points = self.face.settings.points
        return strokes_of(self.face.landmark_groups, _flat(self.face.whole_mean), points.lips_outer,
                          points.lips_inner, points.eyes)

    @cached_property
    def _edges(self) -> np.ndarray:
        """Pairs (E, 2) of landmarks that the mesh joins; none runs inside the mouth or an eye."""
        rest = _flat(self.face.whole_mean)
        owner = np.full(len(rest), -1)
        for number, stroke in enumerate(s for s in self._strokes if s.kind in ("mouth", "eye")):
            owner[stroke.rows] = number
        from scipy.spatial import Delaunay  # slow to import

        triangles = Delaunay(rest).simplices
        own = owner[triangles]
        triangles = triangles[~((own[:, 0] >= 0) & (own == own[:, :1]).all(axis=1))]
        edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [0, 2]]]), axis=1)
        return np.unique(edges, axis=0)

    def frames(self, parameters: np.ndarray) -> Iterator[np.ndarray]:
        """Yield a picture, uint8 RGB (H, W_, 3), for each row of parameters (T, D)."""
        return self.view("face", parameters)

    def view(self, name: str, parameters: np.ndarray) -> Iterator[np.ndarray]:
        """The pictures of a view of :attr:`views`, for parameters (T, D)."""
        for points in self._whole(np.asarray(parameters)):
            yield self._drawn(points, dots=name == "mesh")

    @cached_property
    def _ground(self) -> np.ndarray:
        """The empty picture, fine."""
        return np.full((self.size[1] * _FINE, self.size[0] * _FINE, 3), _GROUND, dtype=np.uint8)

    def _drawn(self, points: np.ndarray, dots: bool) -> np.ndarray:
        width, height = self.size
        canvas = self._ground.copy()
        fine = points * _FINE
        unit = max(1, round(_FINE * height / HEIGHT))
        hull = cv2.convexHull(fine.astype(np.float32))[:, 0]
        cv2.fillPoly(canvas, [_fixed(hull)], _SKIN, cv2.LINE_AA, _SHIFT)
        cv2.polylines(canvas, list(_fixed(fine)[self._edges]), False, _MESH, 1, cv2.LINE_AA, _SHIFT)
        for stroke in self._strokes:
            stroke_on(canvas, stroke, fine, unit)
        if dots:
            for x, y in _fixed(fine[self.face.layout.rows]).tolist():
                cv2.circle(canvas, (x, y), round(1.3 * unit * (1 << _SHIFT)), _DOT, cv2.FILLED, cv2.LINE_AA, _SHIFT)
        return cv2.resize(canvas, (width, height), interpolation=cv2.INTER_AREA)


def stroke_on(canvas: np.ndarray, stroke: Stroke, points: np.ndarray, unit: int) -> None:
    """Draw a stroke through landmarks (L, 2) in pixels of a canvas; ``unit`` is a pixel of the result."""
    curve = _fixed(stroke.curve(points))
    fill = {"lips": _LIPS, "mouth": _MOUTH, "eye": _EYE, "brow": _BROW}.get(stroke.kind)
    line = {"lips": _LIP_LINE, "mouth": _LIP_LINE, "brow": _BROW}.get(stroke.kind, _LINE)
    thick = 2 if stroke.kind == "brow" and not stroke.closed else 1
    if stroke.closed and fill is not None:
        cv2.fillPoly(canvas, [curve], fill, cv2.LINE_AA, _SHIFT)
    if stroke.kind == "eye" and stroke.closed:
        _iris_on(canvas, curve)
    cv2.polylines(canvas, [curve], stroke.closed, line, thick * unit, cv2.LINE_AA, _SHIFT)


def _iris_on(canvas: np.ndarray, eye: np.ndarray) -> None:
    """Draw an iris that looks straight ahead into an eye (N, 2), where its lids leave it to be seen."""
    left, top, width, height = cv2.boundingRect(eye >> _SHIFT)
    part = canvas[max(top, 0):top + height + 2, max(left, 0):left + width + 2]
    centre = eye.mean(axis=0) - (np.array([max(left, 0), max(top, 0)]) << _SHIFT)
    open_, round_ = np.zeros(part.shape[:2], np.uint8), np.zeros(part.shape[:2], np.uint8)
    cv2.fillPoly(open_, [eye - (np.array([max(left, 0), max(top, 0)]) << _SHIFT)], 255, cv2.LINE_AA, _SHIFT)
    cv2.circle(round_, centre.astype(int).tolist(), round(_IRIS_SIZE * np.ptp(eye[:, 0])), 255, cv2.FILLED,
               cv2.LINE_AA, _SHIFT)
    share = (np.minimum(open_, round_) / np.float32(255))[..., None]
    part[:] = (part * (1 - share) + np.array(_IRIS, np.float32) * share).round().astype(np.uint8)


def _fixed(points: np.ndarray) -> np.ndarray:
    """Points in the numbers that OpenCV draws with, between pixels; pixel centres lie at halves."""
    return np.rint((points - 0.5) * (1 << _SHIFT)).astype(np.int32)


def _flat(points: np.ndarray) -> np.ndarray:
    """Points (..., 2 or 3) as they are seen (..., 2)."""
    if points.shape[-1] == 2:
        return points
    x, y, z = np.moveaxis(points, -1, 0)
    return np.stack([x * np.cos(_TURN) + z * np.sin(_TURN), y], axis=-1)
