"""The face put back into a video of the talker: new speech in old footage, in place and pose."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.aam import ActiveAppearanceModel, ClipCode, reconstruct
from dnnvss.face.aam.painter import Painter
from dnnvss.face.base import Face
from dnnvss.render.patch import MARGIN, Patch, bounds
from dnnvss.render.renderer import check_scale, resized
from dnnvss.render.views import VIEWS, model_view

_LEAST = 5
"""Frames in a row that footage must have at least."""
_LIGHT_SECONDS = 0.12
"""Time constant over which the light of the footage is followed."""


@dataclass(frozen=True)
class Footage:
    """A stretch of video of the talker, with its code under the model.

    Args:
        images: uint8 RGB (F, H, W_, 3).
        code: parameters, pose and offsets of its frames.
        rate: frames a second.
        source: where it comes from, for messages.
        pixel: width of a pixel over its height.
    """

    images: np.ndarray
    code: ClipCode
    rate: Fraction
    source: str = ""
    pixel: Fraction = Fraction(1)

    def __len__(self) -> int:
        """The number of frames F."""
        return len(self.images)

    def usable(self) -> tuple["Footage", int]:
        """Return the longest stretch of valid frames, and the number of its first frame.

        Raises:
            DnnvssError: fewer than five frames in a row are valid.
        """
        steps = np.diff(np.concatenate([[0], self.code.valid.astype(int), [0]]))
        starts, stops = np.flatnonzero(steps == 1), np.flatnonzero(steps == -1)
        longest = int((stops - starts).argmax()) if len(starts) else 0
        if not len(starts) or stops[longest] - starts[longest] < _LEAST:
            raise DnnvssError(f"no {_LEAST} frames in a row have usable landmarks", file=self.source,
                              remedy="Choose other footage, or track it again")
        start, stop = int(starts[longest]), int(stops[longest])
        code, part = self.code, slice(start, stop)
        cut = ClipCode(code.parameters[part], code.pose[part], code.shape_offset, code.texture_offset, code.valid[part])
        return replace(self, images=self.images[part], code=cut), start


def walk(pose: np.ndarray, count: int, fill: str) -> np.ndarray:
    """Return which frame of footage (count,) is shown when, for speech of ``count`` frames at the footage's own rate.

    Shorter speech cuts the footage. Where speech is longer, ``"pingpong"`` plays the footage back and forth, turning in
    its first and last quarter where the head moves least, and ``"hold"`` stays on the last frame.

    Args:
        pose: head pose (F, 4) of the footage.
        count: frames wanted.
        fill: ``"pingpong"`` or ``"hold"``.

    Raises:
        DnnvssError: another word than these.
    """
    if fill not in ("pingpong", "hold"):
        raise DnnvssError(f"into_fill is {fill!r}", remedy="Choose pingpong or hold")
    frames = len(pose)
    if count <= frames or fill == "hold":
        return np.minimum(np.arange(count), frames - 1)
    speed = np.linalg.norm(np.gradient(pose * [60, 60, 1, 1], axis=0), axis=1)  # 60: pixels from eye to eye, or so
    quarter = max(1, frames // 4)
    first, last = int(speed[:quarter].argmin()), frames - quarter + int(speed[-quarter:].argmin())
    steps = [np.arange(last)]
    back, forth = np.arange(last, first, -1), np.arange(first, last)
    while sum(map(len, steps)) < count:
        steps += [back, forth]
    return np.concatenate(steps)[:count]


def talker_model(face: Face) -> ActiveAppearanceModel:
    """A face as the model that footage is drawn with.

    Raises:
        DnnvssError: it has no texture.
    """
    if not isinstance(face, ActiveAppearanceModel):
        raise DnnvssError(f"a face of the kind {face.kind} has no texture, so it cannot be put into footage",
                          remedy="Leave into= out")
    return face


def revoicer(face: Face, footage: Footage, order: np.ndarray, scale: float = 1.0) -> "Revoicer":
    """What draws a face into footage (see :class:`Revoicer`).

    Raises:
        DnnvssError: a face without texture, footage of another face, or a scale that is not positive.
    """
    return Revoicer(talker_model(face), footage, order, scale)


class Revoicer:
    """Draws parameters into footage: every frame keeps its head pose, its light, its eyes and its background.

    In each frame lips, chin and jaw are replaced. The new shape takes the frame's pose; the frame's own picture
    follows the mesh's rim inside the ring (see :class:`Patch`), so that neck and cheeks go with the new jaw. The
    texture is the frame's own, plus what the model draws for the new parameters, less what it draws for the frame's:
    pores, stubble and shade stay those of the frame. On and near the lips, whose own detail belongs to other sounds,
    the model's picture stands alone, under the frame's light: a plane in each colour, fitted to what the model leaves
    out of the skin and followed over 0.12 s.

    Args:
        model: the fitted model.
        footage: what to draw into; all its frames valid.
        order: the frame of the footage (T,) that each picture shows (see :func:`walk`).
        scale: size of the result over the size of the footage.
        own_detail: keep what the model leaves out of the frame's skin, and its light; without, the model alone is seen.
        patch: how the texture is laid over the frames; the default where None.

    Raises:
        DnnvssError: the footage was encoded with another model, or the scale is not positive.
    """

    def __init__(self, model: ActiveAppearanceModel, footage: Footage, order: np.ndarray, scale: float = 1.0,
                 own_detail: bool = True, patch: Patch | None = None) -> None:
        code = footage.code
        if code.texture_offset.shape != model.mean_texture.shape or code.parameters.shape[1] != model.size:
            raise DnnvssError("was encoded with another model", file=footage.source, remedy="Encode it again")
        check_scale(scale)
        self.model, self.footage, self.order, self.scale = model, footage, order, scale
        self.patch = patch or Patch(model)
        self._points = reconstruct(model, code)[0]
        self._ring = self.patch.around(self._points)
        self._canvases = np.stack([self.patch.canvas(*frame) for frame in
                                   zip(footage.images, self._points, self._ring, strict=True)])
        self._light = self._lights() * own_detail
        self._skin = self.patch.skin * own_detail

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures in pixels."""
        height, width = resized(self.footage.images[0], self.scale).shape[:2]
        return width, height

    @property
    def texture_offset(self) -> np.ndarray:
        """The texture offset (N, 3) of the footage."""
        return self.footage.code.texture_offset

    def recorded(self, count: int) -> Iterator[np.ndarray]:
        """Yield the first ``count`` frames as they were recorded, in the order and the size of the pictures."""
        for frame in self._order(count).tolist():
            yield resized(self.footage.images[frame], self.scale)

    def points_in_image(self, parameters: np.ndarray) -> np.ndarray:
        """Return the model's points (T, P, 2) in pixels of the pictures, for parameters (T, D) over the whole speech.

        T need not be the number of pictures; it is spread over them.
        """
        index = ((np.arange(len(parameters)) + 0.5) * len(self.order) / len(parameters)).astype(int)
        return self._placed(parameters, self.order[index])

    @property
    def views(self) -> tuple[str, ...]:
        """What :meth:`view` can show; ``reference`` is the footage as it was recorded."""
        return *VIEWS, "reference"

    def view(self, name: str, parameters: np.ndarray) -> Iterator[np.ndarray]:
        """The pictures of a view, for parameters (T, D)."""
        if name == "reference":
            return self.recorded(len(parameters))
        return self.frames(parameters) if name == "face" else model_view(self.model, self, name, parameters)

    def frames(self, parameters: np.ndarray) -> Iterator[np.ndarray]:
        """Yield a picture, uint8 RGB (H, W_, 3), for each row of parameters (T, D)."""
        order = self._order(len(parameters))
        points = self._placed(parameters, order)
        for frame, row, shape in zip(order.tolist(), parameters, points, strict=True):
            yield self._frame(frame, row, shape)

    def _order(self, count: int) -> np.ndarray:
        return self.order[np.minimum(np.arange(count), len(self.order) - 1)]

    def _placed(self, parameters: np.ndarray, frames: np.ndarray) -> np.ndarray:
        shape = self.model.drawn(parameters, self.footage.code.shape_offset)
        return self.model.place(shape, self.footage.code.pose[frames]) * self.scale

    def _frame(self, frame: int, parameters: np.ndarray, points: np.ndarray) -> np.ndarray:
        patch, scale = self.patch, self.scale
        picture = resized(self.footage.images[frame], scale).copy()
        ring = self._ring[frame] * scale
        left, top, right, bottom = bounds(np.vstack([points, ring]), self.size)
        canvas = self._canvas(frame, parameters)
        below = np.vstack([self._points[frame], self._ring[frame]]) * scale - (left, top) + (0, len(canvas))
        corners = np.concatenate([patch.place[patch.triangles[:patch.own]], below[patch.triangles[patch.own:]]])
        shift = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, len(canvas)]])
        painter = Painter(patch.triangles, corners, patch.inner, (bottom - top, right - left), shift)
        atlas = np.zeros((len(canvas) + bottom - top, max(canvas.shape[1], right - left), 3), dtype=np.uint8)
        atlas[:len(canvas), :canvas.shape[1]] = canvas
        atlas[len(canvas):, :right - left] = picture[top:bottom, left:right]
        picture[top:bottom, left:right] = painter.paint(atlas, np.vstack([points, ring]) - (left, top))
        return picture

    def _canvas(self, frame: int, parameters: np.ndarray) -> np.ndarray:
        """Return the frame's canvas (H, W_, 3) uint8 with the new texture laid over it."""
        patch, own = self.patch, self._own(frame)
        light, skin, share = self._light[frame], self._skin, self.patch.share
        drawn = patch.sharpened(self.model.decode(parameters)[1] + self.footage.code.texture_offset)
        texture = drawn + light + skin * (own - self._drawn(frame) - light)
        canvas = self._canvases[frame].copy()
        inside = canvas[MARGIN:-MARGIN, MARGIN:-MARGIN].reshape(-1, 3)
        inside[self.model.warp.pixels] = np.clip(share * texture + (1 - share) * own, 0, 255).round().astype(np.uint8)
        canvas[MARGIN:-MARGIN, MARGIN:-MARGIN] = inside.reshape(patch.size[0] - 2 * MARGIN, -1, 3)
        return canvas

    def _own(self, frame: int) -> np.ndarray:
        """Return the frame's own texture (N, 3) float32."""
        canvas = self._canvases[frame, MARGIN:-MARGIN, MARGIN:-MARGIN]
        return canvas.reshape(-1, 3)[self.model.warp.pixels].astype(np.float32)

    def _drawn(self, frame: int) -> np.ndarray:
        """Return what the model draws (N, 3) for the frame's own parameters."""
        code = self.footage.code
        return self.model.decode(code.parameters[frame])[1] + code.texture_offset

    def _lights(self) -> np.ndarray:
        """Return for each frame a plane of light (F, N, 3) in grey levels: what the model leaves out of its skin."""
        warp = self.model.warp
        row, column = np.divmod(warp.pixels, warp.size[1])
        plane = np.column_stack([np.ones(len(row)), row / warp.size[0] - 0.5, column / warp.size[1] - 0.5])
        fit = np.linalg.pinv(plane * self.patch.skin) * self.patch.skin.T
        slopes = np.stack([fit @ (self._own(f) - self._drawn(f)) for f in range(len(self.footage))])
        from scipy.ndimage import gaussian_filter1d  # slow to import

        slopes = gaussian_filter1d(slopes, _LIGHT_SECONDS * float(self.footage.rate), axis=0, mode="nearest")
        return plane.astype(np.float32) @ slopes.astype(np.float32)
