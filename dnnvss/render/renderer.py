"""The talking face: decoded textures on predicted shapes, in the talker's own picture."""

from collections.abc import Iterator

import cv2
import numpy as np
from scipy.ndimage import distance_transform_edt

from dnnvss.aam import ActiveAppearanceModel
from dnnvss.aam.mesh import rim, signed_area
from dnnvss.aam.model import lip_pairs
from dnnvss.aam.pose import to_reference
from dnnvss.errors import DnnvssError
from dnnvss.render.neutral import Neutral
from dnnvss.render.painter import Painter

_MARGIN = 4
"""Pixels round the texture's picture that carry the neutral frame, for the interpolation at the rim."""
_LIP_MARGIN = 3.0
"""Reference pixels round the lips that take no detail from the neutral frame, and over which it then fades in."""
_BATCH = 64
"""Frames whose textures are decoded together."""


class Renderer:
    """Draws parameters as pictures of the talker.

    The neutral picture stands still except in a ring round the model's mesh, where it follows the mesh's rim (so that
    the skin under the jaw stretches and never tears). Inside the mesh the decoded texture, with the neutral clip's
    offset for its light, is laid over the neutral picture and fades into it at the rim.

    Args:
        model: the fitted model.
        neutral: the frame to draw into.
        scale: size of the result over the size of the neutral picture.
        feather: width in reference pixels over which the texture fades in from the mesh's rim.
        ring: width of the moving ring over the mesh's radius.

    Raises:
        DnnvssError: the neutral frame belongs to another model, or the scale is not positive.
    """

    def __init__(self, model: ActiveAppearanceModel, neutral: Neutral, scale: float = 1.0, feather: float = 6.0,
                 ring: float = 0.45) -> None:
        if neutral.texture_offset.shape != model.mean_texture.shape or neutral.points.shape != model.mean_shape.shape:
            raise DnnvssError(f"neutral frame {neutral.source!r} belongs to another model", remedy="Train again")
        if not scale > 0:
            raise DnnvssError(f"render scale is {scale}", remedy="Give a number above 0; 1 is the video's own size")
        self.model, self.neutral, self.scale = model, neutral, scale
        self._base = _resized(neutral.image, scale)
        self._triangles, self._ring = _with_ring(model, neutral.points, ring)
        self._lips, _ = lip_pairs(model.mean_shape, model.layout.inner)
        self._inner = np.flatnonzero(np.isin(model.warp.triangles, model.layout.inner).all(axis=1))
        canvas = self._canvas()
        self._atlas, self._slots = self._atlas_of(canvas)
        self._constant, self._modes = self._blend(canvas, feather)
        self._box = self._region()
        self._painter = self._result_painter(canvas.shape[0])

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures in pixels."""
        return self._base.shape[1], self._base.shape[0]

    def points_in_image(self, parameters: np.ndarray) -> np.ndarray:
        """Return the model's points (..., P, 2) in pixels of the rendered picture for parameters (..., D).

        Lips that would pass through each other meet half way.
        """
        shape = self.model.decode_shape(parameters) + self.neutral.shape_offset
        for upper, lower in self._lips:
            crossed = np.maximum(shape[..., upper, 1] - shape[..., lower, 1], 0) / 2
            shape[..., upper, 1] -= crossed
            shape[..., lower, 1] += crossed
        return self.model.place(shape, self.neutral.pose) * self.scale

    def frames(self, parameters: np.ndarray) -> Iterator[np.ndarray]:
        """Yield a picture, uint8 RGB (H, W_, 3), for each row of parameters (T, D)."""
        left, top, right, bottom = self._box
        ring = self._ring * self.scale - (left, top)
        for start in range(0, len(parameters), _BATCH):
            part = np.asarray(parameters[start:start + _BATCH])
            textures = self._constant + part.astype(np.float32) @ self._modes
            textures = np.clip(textures, 0, 255).round().astype(np.uint8).reshape(len(part), -1, 3)
            shapes = self.points_in_image(part) - (left, top)
            for texture, shape in zip(textures, shapes, strict=True):
                self._atlas.reshape(-1, 3)[self._slots] = texture
                picture = self._base.copy()
                picture[top:bottom, left:right] = self._painter.paint(self._atlas, np.vstack([shape, ring]))
                yield picture

    def _canvas(self) -> np.ndarray:
        """Return the neutral picture on the texture's shape: the texture's picture and a margin, (H, W_, 3)."""
        warp = self.model.warp
        points = np.vstack([self.neutral.points, self._ring])
        ring = to_reference(self._ring, self.neutral.pose, self.model.reference.pivot)
        target = (np.vstack([warp.shape, ring]) - warp.origin) * warp.scale + _MARGIN
        size = (warp.size[0] + 2 * _MARGIN, warp.size[1] + 2 * _MARGIN)
        painter = Painter(self._triangles, points, self._inner, size, np.eye(2, 3))
        return painter.paint(self.neutral.image, target)

    def _atlas_of(self, canvas: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return canvas and neutral picture in one, and the slots (N,) of the texture's pixels in it, row after row."""
        width = max(canvas.shape[1], self._base.shape[1])
        padded = [np.pad(i, ((0, 0), (0, width - i.shape[1]), (0, 0)), mode="edge") for i in (canvas, self._base)]
        row, column = np.divmod(self.model.warp.pixels, self.model.warp.size[1])
        return np.ascontiguousarray(np.vstack(padded)), (row + _MARGIN) * width + column + _MARGIN

    def _blend(self, canvas: np.ndarray, feather: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the constant (3N,) and the modes (D, 3N) of the texture already laid over the neutral picture.

        With the texture's share ``a`` of a pixel, from 0 at the mesh's rim to 1, the sum ``(1 - a) neutral +
        a (mean + offset + c T)`` is linear in the parameters ``c``.
        """
        model, warp = self.model, self.model.warp
        height, width = warp.size
        mask = np.zeros((height + 2, width + 2), dtype=bool)  # its border makes the picture's edge count as rim
        inside = np.zeros(height * width, dtype=bool)
        inside[warp.pixels] = True
        mask[1:-1, 1:-1] = inside.reshape(height, width)
        depth = distance_transform_edt(mask)[1:-1, 1:-1].ravel()[warp.pixels] - 0.5
        ramp = np.clip(depth / max(feather * warp.scale, 1e-6), 0, 1)
        share = (ramp**2 * (3 - 2 * ramp)).astype(np.float32)[:, None]
        below = canvas[_MARGIN:-_MARGIN, _MARGIN:-_MARGIN].reshape(-1, 3)[warp.pixels]
        still = model.mean_texture + self.neutral.texture_offset + self._detail()
        constant = (1 - share) * below + share * still
        return constant.astype(np.float32).ravel(), (share * model.texture_modes).reshape(model.size, -1)

    def _detail(self) -> np.ndarray:
        """Return what the model leaves out of the neutral skin, (N, 3): pores and stubble, none near the lips."""
        model, neutral = self.model, self.neutral
        shape = to_reference(neutral.points, neutral.pose, model.reference.pivot) - model.mean_shape
        texture = model.warp.sample(neutral.image, neutral.points) - model.mean_texture - neutral.texture_offset
        parameters = model.project((shape - neutral.shape_offset)[None], texture[None])[0]
        left_out = texture - np.tensordot(parameters, model.texture_modes, axes=1)
        row, column = np.divmod(model.warp.pixels, model.warp.size[1])
        lips = np.zeros(model.warp.size, dtype=np.uint8)
        contour = (model.warp.shape[model.layout.outer] - model.warp.origin) * model.warp.scale
        cv2.fillPoly(lips, [np.rint(contour - 0.5).astype(np.int32)], 1)
        away = distance_transform_edt(lips == 0)[row, column] / model.warp.scale
        return left_out * np.clip((away - _LIP_MARGIN) / _LIP_MARGIN, 0, 1)[:, None].astype(np.float32)

    def _region(self) -> tuple[int, int, int, int]:
        """Return left, top, right, bottom of the part of the picture that moves."""
        points = np.vstack([self.neutral.points, self._ring]) * self.scale
        low = np.maximum(np.floor(points.min(axis=0)).astype(int), 0)
        high = np.minimum(np.ceil(points.max(axis=0)).astype(int) + 1, self.size)
        return int(low[0]), int(low[1]), int(high[0]), int(high[1])

    def _result_painter(self, canvas_rows: int) -> Painter:
        """Return the painter of the moving part: model triangles read the canvas, the ring the neutral picture."""
        left, top, right, bottom = self._box
        warp, count = self.model.warp, len(self.model.warp.triangles)
        canvas = (warp.shape - warp.origin) * warp.scale + _MARGIN
        below = np.vstack([self.neutral.points, self._ring]) * self.scale + (0, canvas_rows)
        shift = np.array([[1.0, 0.0, left], [0.0, 1.0, top + canvas_rows]])
        corners = np.concatenate([canvas[self._triangles[:count]], below[self._triangles[count:]]])
        return Painter(self._triangles, corners, self._inner, (bottom - top, right - left), shift)


def _resized(image: np.ndarray, scale: float) -> np.ndarray:
    height, width = image.shape[:2]
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    return image if size == (width, height) else cv2.resize(image, size, interpolation=cv2.INTER_CUBIC)


def _with_ring(model: ActiveAppearanceModel, points: np.ndarray, ring: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the model's triangles followed by those of a ring round them, and the ring's points (R, 2) in the picture.

    Each point of the mesh's rim has a ring point further out from the mesh's middle; ring points never move.
    """
    edge = rim(model.warp.triangles)
    middle = points[edge].mean(axis=0)
    outer = middle + (points[edge] - middle) * (1 + ring)
    own = len(points) + np.arange(len(edge))
    after, own_after = np.roll(edge, -1), np.roll(own, -1)
    strip = np.concatenate([np.column_stack([edge, own, after]), np.column_stack([after, own, own_after])])
    turned = signed_area(np.vstack([points, outer]), strip) < 0
    strip[turned] = strip[turned][:, ::-1]
    return np.concatenate([model.warp.triangles, strip]), outer
