"""Other ways to look at parameters than the whole face: the bare patch, and the mesh."""

from collections.abc import Iterator
from typing import Protocol

import cv2
import numpy as np

from dnnvss.face.aam import ActiveAppearanceModel
from dnnvss.face.aam.drawing import bordered, bordered_painter
from dnnvss.render.patch import BATCH, bounds

_LINE, _LIPS, _POINT, _GROUND = (176, 190, 204), (201, 66, 84), (38, 70, 108), 255
_SHIFT = 4
VIEWS = ("face", "patch", "mesh")
"""What every drawing of a model can show."""


class Placed(Protocol):
    """Where a model's points lie in the pictures of a :class:`Renderer` or a :class:`Revoicer`."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures in pixels."""

    @property
    def texture_offset(self) -> np.ndarray:
        """The texture offset (N, 3) of the clip that is drawn into."""

    def points_in_image(self, parameters: np.ndarray) -> np.ndarray:
        """The model's points (T, P, 2) in pixels of the pictures."""


def model_view(model: ActiveAppearanceModel, pictures: Placed, name: str, parameters: np.ndarray
               ) -> Iterator[np.ndarray]:
    """The bare ``patch`` or the ``mesh`` where the face has them, for parameters (T, D)."""
    draw = {"patch": patch_frames, "mesh": mesh_frames}[name]
    return draw(model, pictures, parameters)


def patch_frames(model: ActiveAppearanceModel, pictures: Placed, parameters: np.ndarray) -> Iterator[np.ndarray]:
    """Yield for parameters (T, D) the decoded texture on its shape, on white, where the face has it; (H, W_, 3)."""
    size = pictures.size
    placed = pictures.points_in_image(parameters)
    left, top, right, bottom = bounds(placed, size)
    painter = bordered_painter(model.warp, model.layout.inner, (bottom - top, right - left))
    for start in range(0, len(parameters), BATCH):
        textures = model.decode(parameters[start:start + BATCH])[1] + pictures.texture_offset
        for texture, points in zip(textures, placed[start:start + BATCH], strict=True):
            picture = np.full((size[1], size[0], 3), _GROUND, dtype=np.uint8)
            picture[top:bottom, left:right] = painter.paint(bordered(model.warp, texture), points - (left, top))
            yield picture


def mesh_frames(model: ActiveAppearanceModel, pictures: Placed, parameters: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the mesh, its points and the lips' contours on white, uint8 RGB (H, W_, 3), for parameters (T, D)."""
    width, height = pictures.size
    for points in pictures.points_in_image(parameters):
        yield draw_mesh(np.full((height, width, 3), _GROUND, dtype=np.uint8), model, points)


def draw_mesh(
    picture: np.ndarray, model: ActiveAppearanceModel, points: np.ndarray, line: tuple[int, int, int] = _LINE
) -> np.ndarray:
    """Return a copy of a picture with the mesh over points (P, 2) in its pixels drawn on it."""
    drawn = np.ascontiguousarray(picture).copy()
    fixed = np.rint((points - 0.5) * (1 << _SHIFT)).astype(np.int32)
    cv2.polylines(drawn, list(fixed[model.warp.triangles]), True, line, 1, cv2.LINE_AA, _SHIFT)
    for contour in (model.layout.outer, model.layout.inner):
        cv2.polylines(drawn, [fixed[contour]], True, _LIPS, 1, cv2.LINE_AA, _SHIFT)
    for x, y in fixed.tolist():
        cv2.circle(drawn, (x, y), round(1.2 * (1 << _SHIFT)), _POINT, cv2.FILLED, cv2.LINE_AA, _SHIFT)
    return drawn
