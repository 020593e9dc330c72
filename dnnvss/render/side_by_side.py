"""Pictures of several faces next to each other."""

from collections.abc import Iterator

import cv2
import numpy as np

_CAPTION = 28
"""Height in pixels of the line of text over each face."""
_MARGIN = 8
"""Pixels beside that text."""
_SIZE = 0.5
"""Size of its letters where they find room; a longer text has smaller ones."""


def side_by_side(*faces: Iterator[np.ndarray], captions: list[str], columns: int = 0) -> Iterator[np.ndarray]:
    """Yield the pictures of several faces next to each other, a line of text over each, as long as all last.

    Args:
        faces: the pictures of each, of one size.
        captions: a line for each.
        columns: faces a row; 0 puts all in one.
    """
    columns = columns or len(faces)
    for pictures in zip(*faces, strict=False):
        tiles = [_captioned(p, text) for p, text in zip(pictures, captions, strict=True)]
        tiles += [np.full_like(tiles[0], 255)] * (-len(tiles) % columns)
        rows = [np.concatenate(tiles[k : k + columns], axis=1) for k in range(0, len(tiles), columns)]
        yield np.concatenate(rows)


def _captioned(picture: np.ndarray, text: str) -> np.ndarray:
    band = np.full((_CAPTION, picture.shape[1], 3), 255, dtype=np.uint8)
    (wide, _), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, _SIZE, 1)
    size = _SIZE * min(1.0, (picture.shape[1] - 2 * _MARGIN) / max(wide, 1))
    cv2.putText(band, text, (_MARGIN, 19), cv2.FONT_HERSHEY_SIMPLEX, size, (40, 40, 40), 1, cv2.LINE_AA)
    return np.concatenate([band, picture])
