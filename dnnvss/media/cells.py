"""Pictures made small while they are decoded: the mean colour of every cell of a grid."""

from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from av.video.reformatter import VideoReformatter

from dnnvss.media.decoding import Look

_PLANAR = "yuv420p"
_BT601 = {2, 5, 6}
"""FFmpeg's numbers of colour spaces whose pictures are made RGB by :data:`_TO_RGB`; 2 is one that is not told."""
_FULL = 2
"""FFmpeg's number of a range of brightness that uses all values."""
_TO_RGB = np.array([[255 / 219, 0, 1.402 * 255 / 224],
                    [255 / 219, -1.772 * 0.114 / 0.587 * 255 / 224, -1.402 * 0.299 / 0.587 * 255 / 224],
                    [255 / 219, 1.772 * 255 / 224, 0]], np.float32)
"""From brightness less 16 and colours less 128 to RGB. **Source**: ITU-R BT.601-7, section 2.5."""


class Cells:
    """From a decoded frame to the mean colours (rows, columns, 3) uint8 RGB of the cells of its upright picture.

    A mean of colours is the colour of the means: of pictures as most recordings have them (H.264, planes of brightness
    and half as fine colours) the cells are means of the planes, which takes a fifth of the time that it takes to
    make the picture RGB first. They differ from those of the RGB picture by rounding.

    Args:
        columns, rows: of the grid.
    """

    def __init__(self, columns: int, rows: int) -> None:
        self.columns, self.rows = columns, rows
        self.scaler = VideoReformatter()

    def __call__(self, frame: Any, look: Look) -> np.ndarray:
        """The cells of a frame."""
        if not self._planar(frame, look):
            image = look.upright(self.scaler.reformat(frame, format="rgb24").to_ndarray())
            return cv2.resize(image, (self.columns, self.rows), interpolation=cv2.INTER_AREA)
        means = np.stack([self._means(plane) for plane in frame.planes], axis=-1) - np.array([16, 128, 128], np.float32)
        return np.clip(means @ _TO_RGB.T + np.float32(0.5), 0, 255).astype(np.uint8)

    def _planar(self, frame: Any, look: Look) -> bool:
        """Whether means of the planes tell the colours of the cells."""
        return (frame.format.name == _PLANAR and not look.turned and frame.width % 2 == frame.height % 2 == 0
                and frame.width >= 4 * self.columns and frame.height >= 4 * self.rows
                and int(frame.colorspace) in _BT601 and int(frame.color_range) != _FULL)

    def _means(self, plane: Any) -> np.ndarray:
        values = np.frombuffer(plane, np.uint8).reshape(-1, plane.line_size)[: plane.height, : plane.width]
        return shares(plane.height, self.rows) @ (values.astype(np.float32) @ shares(plane.width, self.columns).T)


@lru_cache(maxsize=16)
def shares(pixels: int, cells: int) -> np.ndarray:
    """How much each pixel of a row counts in the mean of each cell, (cells, pixels) float32; each row sums to 1."""
    edges, at = np.linspace(0, pixels, cells + 1), np.arange(pixels)
    inside = np.minimum(edges[1:, None], at + 1) - np.maximum(edges[:-1, None], at)
    return (np.maximum(inside, 0) * cells / pixels).astype(np.float32)
