"""How a face of any kind is drawn: one door for all who want to see it."""

from collections.abc import Iterator
from pathlib import Path
from typing import Protocol

import numpy as np

from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.face.aam import ActiveAppearanceModel
from dnnvss.face.base import Face, Textured
from dnnvss.face.encoding import EncodedCorpus
from dnnvss.face.points import PointsFace
from dnnvss.face.rig import RigFace
from dnnvss.render.bars import Bars
from dnnvss.render.neutral import Neutral, choose_neutral
from dnnvss.render.renderer import Renderer
from dnnvss.render.sketch import Sketch

_STILL = 0.25
"""Size of a still drawing of points at zoom 1, over that of its video: about that of a talker's mouth."""


class Pictures(Protocol):
    """What turns parameters of a face into pictures of one size."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures in pixels."""

    @property
    def views(self) -> tuple[str, ...]:
        """What :meth:`view` can show; ``face`` comes first."""

    def points_in_image(self, parameters: np.ndarray) -> np.ndarray:
        """The face's points (T, P, 2) in pixels of the pictures, for parameters (T, D)."""

    def frames(self, parameters: np.ndarray) -> Iterator[np.ndarray]:
        """Yield a picture, uint8 RGB (H, W_, 3), for each row of parameters (T, D)."""

    def view(self, name: str, parameters: np.ndarray) -> Iterator[np.ndarray]:
        """The pictures of a view of :attr:`views`, for parameters (T, D)."""


def open_pictures(face: Face, ground: Path, scale: float = 1.0) -> Pictures:
    """What draws a face.

    Args:
        face: of any kind.
        ground: the file of what it is drawn into, written by :func:`keep_ground`; a face without texture needs none.
        scale: size of the pictures over their usual size.

    Raises:
        DnnvssError: faces of this kind cannot be drawn, the file is missing or of another face, or the scale is not
            positive.
    """
    if isinstance(face, ActiveAppearanceModel):
        return Renderer(face, Neutral.load(ground), scale)
    if isinstance(face, PointsFace):
        return Sketch(face, scale)
    if isinstance(face, RigFace):
        return Bars(face, scale)
    raise _undrawn(face)


def keep_ground(corpus: Corpus, encoded: EncodedCorpus, path: Path) -> Path | None:
    """Write what a face is drawn into and return the path; None where its kind needs nothing."""
    if isinstance(encoded.face, ActiveAppearanceModel):
        return choose_neutral(corpus, encoded).save(path)
    return None


def still(face: Face, parameters: np.ndarray, zoom: float = 1.0) -> np.ndarray:
    """A picture, uint8 RGB (H, W_, 3), of parameters (D,) on white, without anything round the face.

    Raises:
        DnnvssError: faces of this kind cannot be drawn.
    """
    if isinstance(face, Textured):
        return face.picture(parameters, zoom)
    if isinstance(face, PointsFace):
        return next(Sketch(face, zoom * _STILL).frames(parameters[None]))
    if isinstance(face, RigFace):
        return next(Bars(face, zoom).frames(parameters[None]))
    raise _undrawn(face)


def _undrawn(face: Face) -> DnnvssError:
    return DnnvssError(f"a face of the kind {face.kind} cannot be drawn",
                       remedy="Write its curves for another program (export_curves=FILE.csv)")
