"""Where the moving patch lies: the model's mesh with a ring round it, its canvas, and how it fades into a picture."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from dnnvss.face.aam import ActiveAppearanceModel
from dnnvss.face.aam.mesh import rim, signed_area
from dnnvss.face.aam.painter import Painter

BATCH = 64
"""Frames whose textures are decoded together."""
MARGIN = 4
"""Pixels round the texture's picture that carry the picture below, for the interpolation at the rim."""
_LIP_MARGIN = 3.0
"""Reference pixels round the lips that take no detail from the picture below, and over which it then fades in."""

_DEVIATIONS = 6.0
"""Random sentences of a talker of twenty clips moved the chin by 4.5 of its deviations."""
_BLUR = 1.0
"""Standard deviation in texture pixels of what the mouth's sharpness is measured against."""


@dataclass(frozen=True)
class Patch:
    """A model's texture as it is laid over pictures.

    Each point of the mesh's rim has a ring point further out from the mesh's middle. Ring points never move; between
    rim and ring the picture below follows the rim, so that the skin under the jaw stretches and never tears.

    Args:
        model: the fitted model.
        feather: width in reference pixels over which the texture fades in from the mesh's rim.
        ring: least width of the moving ring over the mesh's radius; see :attr:`width`.
        sharpness: how much of its difference from a blurred copy is added to the inside of the mouth. Reading and
            drawing a texture each blur it, and the modes leave the finest out; 0.7 gives teeth and tongue their
            contrast back without a larger error (measured in ``docs/face.md``).
    """

    model: ActiveAppearanceModel
    feather: float = 6.0
    ring: float = 0.45
    sharpness: float = 0.7

    @cached_property
    def edge(self) -> np.ndarray:
        """The points (R,) on the mesh's rim, in order."""
        return rim(self.model.warp.triangles)

    @cached_property
    def triangles(self) -> np.ndarray:
        """The model's triangles followed by those of the ring, over P + R points."""
        shape, edge = self.model.warp.shape, self.edge
        own = len(shape) + np.arange(len(edge))
        after, own_after = np.roll(edge, -1), np.roll(own, -1)
        strip = np.concatenate([np.column_stack([edge, own, after]), np.column_stack([after, own, own_after])])
        turned = signed_area(np.vstack([shape, self.around(shape)]), strip) < 0
        strip[turned] = strip[turned][:, ::-1]
        return np.concatenate([self.model.warp.triangles, strip])

    @cached_property
    def width(self) -> np.ndarray:
        """The width (R,) of the ring at each rim point, over the mesh's radius there.

        A ring point lies :data:`_DEVIATIONS` deviations of its rim point's way outwards beyond that, so that a chin
        that moves much does not pass it.
        """
        model = self.model
        away = model.mean_shape[self.edge] - model.mean_shape[self.edge].mean(axis=0)
        radius = np.linalg.norm(away, axis=1)
        outwards = (model.shape_modes[:, self.edge] * (away / radius[:, None])).sum(axis=-1)
        deviation = np.sqrt(np.asarray(model.deviations, float) ** 2 @ outwards**2)
        return np.asarray(np.maximum(self.ring, _DEVIATIONS * deviation / radius))

    @property
    def own(self) -> int:
        """The number of the model's own triangles."""
        return len(self.model.warp.triangles)

    @cached_property
    def inner(self) -> np.ndarray:
        """The triangles between the lips, which may be thinner than a pixel."""
        return np.flatnonzero(np.isin(self.model.warp.triangles, self.model.layout.inner).all(axis=1))

    @cached_property
    def size(self) -> tuple[int, int]:
        """Height and width of the canvas: the texture's picture and a margin."""
        height, width = self.model.warp.size
        return height + 2 * MARGIN, width + 2 * MARGIN

    @cached_property
    def place(self) -> np.ndarray:
        """The model's points (P, 2) on the canvas."""
        warp = self.model.warp
        return (warp.shape - warp.origin) * warp.scale + MARGIN

    def around(self, points: np.ndarray) -> np.ndarray:
        """Return the ring's points (..., R, 2) for the model's points (..., P, 2)."""
        edge = points[..., self.edge, :]
        middle = edge.mean(axis=-2, keepdims=True)
        return middle + (edge - middle) * (1 + self.width[:, None])

    def canvas(self, image: np.ndarray, points: np.ndarray, ring: np.ndarray) -> np.ndarray:
        """A picture (H, W_, 3) drawn on the canvas, by its points (P, 2) and ring (R, 2).

        On the canvas the ring lies round the texture's shape: its mouth is open, and the chin of that may be below a
        ring round the picture's face, which would turn the triangles between the two over.
        """
        target = np.vstack([self.place, self.around(self.place)])
        return Painter(self.triangles, np.vstack([points, ring]), self.inner, self.size, np.eye(2, 3)).paint(image,
                                                                                                             target)

    @cached_property
    def share(self) -> np.ndarray:
        """The texture's share (N, 1) of each of its pixels: 0 at the mesh's rim, rising smoothly to 1 inside."""
        warp = self.model.warp
        height, width = warp.size
        mask = np.zeros((height + 2, width + 2), dtype=bool)  # its border makes the picture's edge count as rim
        inside = np.zeros(height * width, dtype=bool)
        inside[warp.pixels] = True
        mask[1:-1, 1:-1] = inside.reshape(height, width)
        depth = _depth(mask)[1:-1, 1:-1].ravel()[warp.pixels] - 0.5
        ramp = np.clip(depth / max(self.feather * warp.scale, 1e-6), 0, 1)
        return (ramp**2 * (3 - 2 * ramp)).astype(np.float32)[:, None]

    @cached_property
    def skin(self) -> np.ndarray:
        """How much of each pixel (N, 1) is skin: 0 on and near lips and modelled eyes, rising to 1 away from them."""
        warp = self.model.warp
        row, column = np.divmod(warp.pixels, warp.size[1])
        layout, bare = self.model.layout, np.ones(warp.size, dtype=np.uint8)
        for ring in (layout.outer, *(layout.groups[g] for g in self.model.config.points.eyes if g in layout.groups)):
            contour = (warp.shape[ring] - warp.origin) * warp.scale
            cv2.fillPoly(bare, [np.rint(contour - 0.5).astype(np.int32)], 0)
        away = _depth(bare)[row, column] / warp.scale
        return np.clip((away - _LIP_MARGIN) / _LIP_MARGIN, 0, 1)[:, None].astype(np.float32)

    def sharpened(self, textures: np.ndarray) -> np.ndarray:
        """Return textures (..., N, 3) float32, sharpened inside the mouth; a linear map, so modes may go through it."""
        flat = textures.reshape(-1, *textures.shape[-2:])
        return np.stack([self._sharpened(t) for t in flat]).reshape(textures.shape) if self.sharpness else textures

    def _sharpened(self, texture: np.ndarray) -> np.ndarray:
        warp = self.model.warp
        picture = warp.picture(texture.astype(np.float32))
        blurred = cv2.GaussianBlur(picture, (0, 0), _BLUR) / self._near
        sharp = picture + self.sharpness * self._mouth[..., None] * (picture - blurred)
        return sharp.reshape(-1, 3)[warp.pixels]

    @cached_property
    def _known(self) -> np.ndarray:
        """Which pixels of the texture's picture (H, W_) lie in the mesh."""
        known = np.zeros(self.model.warp.size, dtype=bool)
        known.ravel()[self.model.warp.pixels] = True
        return known

    @cached_property
    def _near(self) -> np.ndarray:
        """The share (H, W_, 1) of what a blur sees around each pixel that lies in the mesh."""
        return np.maximum(cv2.GaussianBlur(self._known.astype(np.float32), (0, 0), _BLUR), 1e-3)[..., None]

    @cached_property
    def _mouth(self) -> np.ndarray:
        """How much of each pixel of the texture's picture (H, W_) lies between the lips."""
        warp = self.model.warp
        mouth = np.zeros(warp.size, dtype=np.uint8)
        contour = (warp.shape[self.model.layout.inner] - warp.origin) * warp.scale
        cv2.fillPoly(mouth, [np.rint(contour - 0.5).astype(np.int32)], 1)
        return cv2.GaussianBlur(mouth.astype(np.float32), (0, 0), 0.7 * _BLUR)


def _depth(mask: np.ndarray) -> np.ndarray:
    """Return how far each pixel (H, W_) that is not zero is from the nearest one that is."""
    return cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)


def bounds(points: np.ndarray, size: tuple[int, int]) -> tuple[int, int, int, int]:
    """Return left, top, right, bottom of the pixels that hold points (..., 2), inside a picture of width and height."""
    flat = points.reshape(-1, 2)
    low = np.maximum(np.floor(flat.min(axis=0)).astype(int), 0)
    high = np.minimum(np.ceil(flat.max(axis=0)).astype(int) + 1, size)
    return int(low[0]), int(low[1]), int(high[0]), int(high[1])
