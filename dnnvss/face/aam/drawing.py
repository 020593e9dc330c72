"""The model's own picture: decoded texture on decoded shape, on white, without a talker's frame round it."""

import numpy as np

from dnnvss.face.aam.mesh import Warp
from dnnvss.face.aam.painter import Painter
<<<<<<< HEAD
from dnnvss.face.lips import lip_pairs, parted

if TYPE_CHECKING:
    from dnnvss.face.aam.model import ActiveAppearanceModel
=======
>>>>>>> 67ee68f (The AAM draws itself without a circle; circles of features and runs may not come back)

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
<<<<<<< HEAD
    inner = np.flatnonzero(np.isin(warp.triangles, model.layout.inner).all(axis=1))
    return Painter(warp.triangles, source, inner, size, WHITE_CORNER)
=======
    between = np.flatnonzero(np.isin(warp.triangles, inner).all(axis=1))
    return Painter(warp.triangles, source, between, size, WHITE_CORNER)


def parted(shapes: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Shapes (..., P, 2) in which lips that would pass through each other meet half way.

    Args:
        shapes: points.
        pairs: of the inner lips, (n, 2), see :func:`dnnvss.face.lips.lip_pairs`.
    """
    shapes = shapes.copy()
    for upper, lower in pairs:
        crossed = np.maximum(shapes[..., upper, 1] - shapes[..., lower, 1], 0) / 2
        shapes[..., upper, 1] -= crossed
        shapes[..., lower, 1] += crossed
    return shapes
>>>>>>> 67ee68f (The AAM draws itself without a circle; circles of features and runs may not come back)
