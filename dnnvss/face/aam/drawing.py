"""The model's own picture: decoded texture on decoded shape, on white, without a talker's frame round it."""

import numpy as np

from dnnvss.face.aam.mesh import Warp
from dnnvss.face.aam.painter import Painter

_MARGIN = 6
"""Reference pixels of white round the texture's shape."""
WHITE_CORNER = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, 0.5]])
"""Where pixels outside the mesh come from, as an affine map: the corner of a texture with a white border."""


def draw(warp: Warp, inner: np.ndarray, points: np.ndarray, texture: np.ndarray, zoom: float = 1.0) -> np.ndarray:
    """The picture, uint8 (H, W_, 3), of points (P, 2) with a texture (N, 3); ``inner`` are the points of the lips."""
    height, width = (round((s / warp.scale + 2 * _MARGIN) * zoom) for s in warp.size)
    painter = bordered_painter(warp, inner, (height, width))
    return painter.paint(bordered(warp, texture), (points - warp.origin + _MARGIN) * zoom)


def bordered(warp: Warp, texture: np.ndarray) -> np.ndarray:
    """A texture (N, 3) as a picture, uint8 (H, W_, 3), with a white border of one pixel."""
    picture = warp.picture(np.clip(texture, 0, 255).round().astype(np.uint8), fill=255)
    return np.pad(picture, ((1, 1), (1, 1), (0, 0)), constant_values=255)


def bordered_painter(warp: Warp, inner: np.ndarray, size: tuple[int, int]) -> Painter:
    """What draws pictures of :func:`bordered` on a model's points, at a height and a width."""
    source = (warp.shape - warp.origin) * warp.scale + 1
    between = np.flatnonzero(np.isin(warp.triangles, inner).all(axis=1))
    return Painter(warp.triangles, source, between, size, WHITE_CORNER)
