"""The talking face: decoded textures on predicted shapes, in the talker's own picture."""

from collections.abc import Iterator

import cv2
import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.aam import ActiveAppearanceModel
from dnnvss.face.aam.painter import Painter, PaintPlan
from dnnvss.face.pose import to_reference
from dnnvss.render.neutral import Neutral
from dnnvss.render.patch import BATCH, MARGIN, Patch, bounds
from dnnvss.render.views import VIEWS, model_view


class Renderer:
    """Draws parameters as pictures of the talker.

    The neutral picture stands still except in a ring round the model's mesh, where it follows the mesh's rim. Inside
    the mesh the decoded texture, with the neutral clip's offset for its light, is laid over the neutral picture and
    fades into it at the rim (see :class:`Patch`).

    Args:
        model: the fitted model.
        neutral: the frame to draw into.
        scale: size of the result over the size of the neutral picture.

    Raises:
        DnnvssError: the neutral frame belongs to another model, or the scale is not positive.
    """

    def __init__(self, model: ActiveAppearanceModel, neutral: Neutral, scale: float = 1.0) -> None:
        if neutral.texture_offset.shape != model.mean_texture.shape or neutral.points.shape != model.mean_shape.shape:
            raise DnnvssError(f"neutral frame {neutral.source!r} belongs to another model", remedy="Train again")
        check_scale(scale)
        self.model, self.neutral, self.scale, self.patch = model, neutral, scale, Patch(model)
        self._base = resized(neutral.image, scale)
        self._ring = self.patch.around(neutral.points)
        canvas = self.patch.canvas(neutral.image, neutral.points, self._ring)
        self.atlas = _atlas(canvas, self._base)
        self._constant, self._modes = self._blend(canvas)
        self._box = bounds(np.vstack([neutral.points, self._ring]) * scale, self.size)
        self.painter = self._result_painter()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures in pixels."""
        return self._base.shape[1], self._base.shape[0]

    @property
    def moving(self) -> tuple[slice, slice]:
        """Rows and columns of the pictures that hold all that moves."""
        left, top, right, bottom = self._box
        return slice(top, bottom), slice(left, right)

    @property
    def texture_offset(self) -> np.ndarray:
        """The texture offset (N, 3) of the neutral frame's clip."""
        return self.neutral.texture_offset

    def points_in_image(self, parameters: np.ndarray) -> np.ndarray:
        """Return the model's points (..., P, 2) in pixels of the rendered picture for parameters (..., D).

        Lips meet and never cross, and no triangle folds (see :class:`~dnnvss.face.aam.fold.FoldGuard`).
        """
        shape = self.model.drawn(parameters, self.neutral.shape_offset)
        return self.model.place(shape, self.neutral.pose) * self.scale

    def meshes(self, parameters: np.ndarray) -> np.ndarray:
        """Return mesh and ring (T, P + R, 2) in pixels of the part that moves, for parameters (T, D)."""
        points = self.points_in_image(parameters)
        ring = np.broadcast_to(self._ring * self.scale, (len(points), *self._ring.shape))
        return np.concatenate([points, ring], axis=1) - self._box[:2]

    @property
    def views(self) -> tuple[str, ...]:
        """What :meth:`view` can show."""
        return VIEWS

    def view(self, name: str, parameters: np.ndarray) -> Iterator[np.ndarray]:
        """The pictures of a view, for parameters (T, D)."""
        return self.frames(parameters) if name == "face" else model_view(self.model, self, name, parameters)

    def frames(self, parameters: np.ndarray) -> Iterator[np.ndarray]:
        """Yield a picture, uint8 RGB (H, W_, 3), for each row of parameters (T, D)."""
        height, width = self.model.warp.size
        slot = self.atlas[MARGIN:MARGIN + height, MARGIN:MARGIN + width]
        for start in range(0, len(parameters), BATCH):
            part = np.asarray(parameters[start:start + BATCH])
            textures = self._constant + part.astype(np.float32) @ self._modes
            if self.model.colours is not None:
                coloured = textures.reshape(len(part), -1, 3)
                coloured[:, self.model.warp.pixels] += self.patch.share * self.model.colour(part)
            textures = np.clip(textures, 0, 255, out=textures).round(out=textures).astype(np.uint8)
            plan = self.painter.plan(self.meshes(part))
            for index, texture in enumerate(textures.reshape(-1, *slot.shape)):
                slot[:] = texture
                yield self.composite(plan, index)

    def composite(self, plan: PaintPlan, index: int) -> np.ndarray:
        """Return the picture (H, W_, 3) of the texture that is in the atlas, with the mesh of a plan."""
        picture = self._base.copy()
        picture[self.moving] = self.painter.paint_planned(self.atlas, plan, index)
        return picture

    def _blend(self, canvas: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the constant (3HW_,) and the modes (D, 3HW_) of the texture's picture, laid over the neutral one.

        With the texture's share ``a`` of a pixel, from 0 at the mesh's rim to 1, the sum ``(1 - a) neutral +
        a (mean + offset + c T)`` is linear in the parameters ``c``.
        """
        model, pixels, share = self.model, self.model.warp.pixels, self.patch.share
        constant = canvas[MARGIN:-MARGIN, MARGIN:-MARGIN].reshape(-1, 3).astype(np.float32)
        still = model.mean_texture + self.neutral.texture_offset + self._detail()
        constant[pixels] = (1 - share) * constant[pixels] + share * self.patch.sharpened(still)
        modes = np.zeros((model.size, *constant.shape), dtype=np.float32)
        modes[:, pixels] = share * self.patch.sharpened(model.texture_modes)
        return constant.ravel(), modes.reshape(model.size, -1)

    def _detail(self) -> np.ndarray:
        """Return what the model leaves out of the neutral skin, (N, 3): pores and stubble, none near the lips."""
        model, neutral = self.model, self.neutral
        shape = to_reference(neutral.points, neutral.pose, model.reference.pivot) - model.mean_shape
        still = model.mean_texture + neutral.texture_offset
        seen = model.read_texture(neutral.image, neutral.points) - still
        parameters = model.project((shape - neutral.shape_offset)[None], seen[None])[0]
        texture = model.warp.sample(neutral.image, neutral.points) - still
        left_out = texture - np.tensordot(parameters, model.texture_modes, axes=1) - model.colour(parameters)
        return left_out * self.patch.skin

    def _result_painter(self) -> Painter:
        """Return the painter of the moving part: model triangles read the canvas, the ring the neutral picture."""
        left, top, right, bottom = self._box
        patch, rows = self.patch, self.patch.size[0]
        below = np.vstack([self.neutral.points, self._ring]) * self.scale + (0, rows)
        shift = np.array([[1.0, 0.0, left], [0.0, 1.0, top + rows]])
        corners = np.concatenate([patch.place[patch.triangles[:patch.own]], below[patch.triangles[patch.own:]]])
        return Painter(patch.triangles, corners, patch.inner, (bottom - top, right - left), shift)


def _atlas(canvas: np.ndarray, picture: np.ndarray) -> np.ndarray:
    """Return canvas and picture in one, the canvas above."""
    width = max(canvas.shape[1], picture.shape[1])
    padded = [np.pad(i, ((0, 0), (0, width - i.shape[1]), (0, 0)), mode="edge") for i in (canvas, picture)]
    return np.ascontiguousarray(np.vstack(padded))


def check_scale(scale: float) -> None:
    """Refuse sizes of a result over the size of its video that are not positive."""
    if not scale > 0:
        raise DnnvssError(f"render scale is {scale}", remedy="Give a number above 0; 1 is the video's own size")


def resized(image: np.ndarray, scale: float) -> np.ndarray:
    """Return a picture at ``scale`` times its size."""
    height, width = image.shape[:2]
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    return image if size == (width, height) else cv2.resize(image, size, interpolation=cv2.INTER_CUBIC)
