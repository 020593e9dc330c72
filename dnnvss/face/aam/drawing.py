"""The model's own picture: decoded texture on decoded shape, on white, without a talker's frame round it."""

from typing import TYPE_CHECKING

import numpy as np

from dnnvss.face.aam.painter import Painter
from dnnvss.face.lips import lip_pairs, parted

if TYPE_CHECKING:
    from dnnvss.face.aam.model import ActiveAppearanceModel

_MARGIN = 6
"""Reference pixels of white round the texture's shape."""
WHITE_CORNER = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, 0.5]])
"""Where pixels outside the mesh come from, as an affine map: the corner of a texture with a white border."""


def draw(model: "ActiveAppearanceModel", parameters: np.ndarray, zoom: float = 1.0) -> np.ndarray:
    """The picture, uint8 (H, W_, 3), of parameters (D,)."""
    points, texture = model.decode(parameters)
    warp = model.warp
    points = parted(points, lip_pairs(model.mean_shape, model.layout.inner)[0])
    height, width = (round((s / warp.scale + 2 * _MARGIN) * zoom) for s in warp.size)
    painter = bordered_painter(model, (height, width))
    return painter.paint(bordered(model, texture), (points - warp.origin + _MARGIN) * zoom)


def bordered(model: "ActiveAppearanceModel", texture: np.ndarray) -> np.ndarray:
    """A texture (N, 3) as a picture, uint8 (H, W_, 3), with a white border of one pixel."""
    picture = model.warp.picture(np.clip(texture, 0, 255).round().astype(np.uint8), fill=255)
    return np.pad(picture, ((1, 1), (1, 1), (0, 0)), constant_values=255)


def bordered_painter(model: "ActiveAppearanceModel", size: tuple[int, int]) -> Painter:
    """What draws pictures of :func:`bordered` on the model's points, at a height and a width."""
    warp = model.warp
    source = (warp.shape - warp.origin) * warp.scale + 1
    inner = np.flatnonzero(np.isin(warp.triangles, model.layout.inner).all(axis=1))
    return Painter(warp.triangles, source, inner, size, WHITE_CORNER)
