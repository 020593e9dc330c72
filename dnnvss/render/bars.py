"""A rig without a head, drawn: a bar for each curve, from its least to its greatest value."""

from collections.abc import Iterator

import cv2
import numpy as np

from dnnvss.face.rig import RigFace
from dnnvss.render.renderer import check_scale

_ROW, _BAR, _NAME, _COLUMN = 18, 9, 190, 420
"""Pixels at scale 1: of a row, the height of its bar, the room of its name, and the width of a column."""
_ROWS = 26
"""Rows of a column."""
_GROUND, _EMPTY, _FULL, _TEXT = (250, 248, 245), (228, 224, 218), (62, 106, 164), (60, 56, 52)


class Bars:
    """Draws a rig as bars with names beside them.

    Args:
        face: the rig.
        scale: size of the pictures over their usual one.

    Raises:
        DnnvssError: the scale is not positive.
    """

    views = ("face",)

    def __init__(self, face: RigFace, scale: float = 1.0) -> None:
        check_scale(scale)
        self.face = face
        count = len(face.names)
        rows, columns = min(count, _ROWS), -(-count // _ROWS)
        self._zoom = scale
        self.size: tuple[int, int] = (
            2 * round(columns * _COLUMN * scale / 2),
            2 * round((rows + 1) * _ROW * scale / 2),
        )

    def points_in_image(self, parameters: np.ndarray) -> np.ndarray:
        """No points (T, 0, 2), for parameters (T, D)."""
        return self.face.points(parameters)

    def frames(self, parameters: np.ndarray) -> Iterator[np.ndarray]:
        """Yield a picture, uint8 RGB (H, W_, 3), for each row of parameters (T, D)."""
        low, high = self.face.ranges.T
        shares = np.clip((np.asarray(parameters, float) - low) / (high - low), 0, 1)
        rests = np.clip((self.face.rest[self.face.moving] - low) / (high - low), 0, 1)
        ground = self._ground()
        for row in shares:
            picture = ground.copy()
            for i, (share, rest) in enumerate(zip(row, rests, strict=True)):
                self._bar(picture, i, min(share, rest), max(share, rest), _FULL)
            yield picture

    def view(self, name: str, parameters: np.ndarray) -> Iterator[np.ndarray]:
        """The pictures of the only view."""
        del name
        return self.frames(parameters)

    def _bar(
        self, picture: np.ndarray, i: int, start: float, end: float, colour: tuple[int, int, int]
    ) -> None:
        column, row = divmod(i, _ROWS)
        left, width = column * _COLUMN + _NAME, _COLUMN - _NAME - 12
        top = (row + 0.5) * _ROW + (_ROW - _BAR) / 2
        first, last = (
            (round((left + width * at) * self._zoom), round(y * self._zoom))
            for at, y in ((start, top), (end, top + _BAR))
        )
        if last[0] > first[0]:
            cv2.rectangle(picture, first, (last[0] - 1, last[1]), colour, cv2.FILLED)

    def _ground(self) -> np.ndarray:
        picture = np.full((self.size[1], self.size[0], 3), _GROUND, np.uint8)
        for i, name in enumerate(self.face.names):
            self._bar(picture, i, 0.0, 1.0, _EMPTY)
            column, row = divmod(i, _ROWS)
            at = (
                round((column * _COLUMN + 10) * self._zoom),
                round((row + 1.28) * _ROW * self._zoom),
            )
            cv2.putText(
                picture,
                name[:28],
                at,
                cv2.FONT_HERSHEY_SIMPLEX,
                0.4 * self._zoom,
                _TEXT,
                1,
                cv2.LINE_AA,
            )
        return picture
