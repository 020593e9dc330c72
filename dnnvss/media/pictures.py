"""Single pictures in files."""

from pathlib import Path

import cv2
import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError


def write_picture(path: str | Path, image: np.ndarray) -> Path:
    """Write a picture, uint8 RGB (H, W_, 3), in the format of the path's suffix (``.png`` loses nothing).

    Raises:
        DnnvssError: no such format, or the file cannot be written.
    """
    path = Path(path)
    if not cv2.haveImageWriter(path.name):
        raise DnnvssError("is no kind of picture", file=path, remedy="End the name in .png")
    _, coded = cv2.imencode(path.suffix, cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
    with files.replacing(path) as temporary:
        temporary.write_bytes(coded.tobytes())  # OpenCV does not say that a disk is full
    return path
