"""Flat shapes of four corners laid over one another: by OpenCV, or by a graphics card where that is faster."""

import os
from functools import cache
from typing import Protocol

import cv2
import numpy as np

from dnnvss.errors import DnnvssError

VARIABLE = "DNNVSS_DRAW"
"""The environment variable that says what draws heads: one of :data:`WAYS`."""
WAYS = ("auto", "opencv", "egl")
_SHIFT = 4


class Fill(Protocol):
    """What lays shapes over one another, the first one furthest back."""

    def __call__(self, corners: np.ndarray, colours: np.ndarray) -> np.ndarray:
        """A picture, uint8 RGB (H, W_, 3).

        Args:
            corners: pixels (N, 4, 2) of the picture; a triangle repeats its third.
            colours: (N, 3), 0 to 255.
        """


def fill_for(size: tuple[int, int], ground: tuple[int, int, int], smooth: int) -> Fill:
    """What draws pictures here: as :data:`VARIABLE` says, else a graphics card where there is one, else OpenCV.

    Mesa draws EGL's pictures on the processor where there is no card; that is used only where it is asked for, so that
    the same machine always draws the same picture.

    Args:
        size: width and height of the picture in pixels.
        ground: its colour where there is nothing.
        smooth: drawn pixels for each pixel of the picture, along each axis.

    Raises:
        DnnvssError: the variable says something else, or EGL, which cannot be had.
    """
    way = os.environ.get(VARIABLE) or WAYS[0]
    if way not in WAYS:
        raise DnnvssError(f"{VARIABLE}={way} is no way to draw", remedy=f"Set it to {', '.join(WAYS)}")
    if way == "egl" or (way == "auto" and _card()):
        from dnnvss.render.egl import EglFill

        return EglFill(size, ground, smooth)
    return OpenCvFill(size, ground, smooth)


@cache
def _card() -> bool:
    """Whether EGL draws by a graphics card."""
    from dnnvss.render.egl import open_egl

    try:
        return open_egl().by_card
    except DnnvssError:
        return False


class OpenCvFill:
    """Lays shapes over one another by OpenCV, on one core; arguments as :func:`fill_for`."""

    def __init__(self, size: tuple[int, int], ground: tuple[int, int, int], smooth: int) -> None:
        self.size, self.smooth = size, smooth
        self._ground = np.tile(np.array(ground, np.uint8), (size[1] * smooth, size[0] * smooth, 1))

    def __call__(self, corners: np.ndarray, colours: np.ndarray) -> np.ndarray:
        """The picture (see :class:`Fill`)."""
        image = self._ground.copy()
        from_middles = corners * self.smooth - 0.5  # OpenCV counts from the middle of the first pixel
        shapes = np.round(from_middles * 2**_SHIFT).astype(np.int32)
        for shape, colour in zip(shapes, colours.tolist(), strict=True):
            cv2.fillConvexPoly(image, shape, colour, cv2.LINE_8, _SHIFT)
        return image if self.smooth == 1 else cv2.resize(image, self.size, interpolation=cv2.INTER_AREA)
