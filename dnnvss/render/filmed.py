"""A video with its landmarks, made footage that a face is put into."""

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from dnnvss.corpus import checkup
from dnnvss.errors import DnnvssError
from dnnvss.face.aam import ActiveAppearanceModel, encode_clip
from dnnvss.face.base import Face
from dnnvss.face.clips import UnusableClipError
from dnnvss.render.footage import Footage, talker_model

_OUTSIDE = 0.25
"""Share of the model's points outside the picture from which on a frame's landmarks are not this picture's."""


@dataclass(frozen=True)
class Filmed:
    """A video with its landmarks.

    Args:
        images: uint8 RGB (F, H, W_, 3).
        points: landmarks (F, L, 2) in pixels.
        valid: (F,) bool, frames whose landmarks were found.
        rate: frames a second.
        source: where it comes from, for messages.
        pixel: width of a pixel over its height.
    """

    images: np.ndarray
    points: np.ndarray
    valid: np.ndarray
    rate: Fraction
    source: str
    pixel: Fraction = Fraction(1)


def encode_footage(face: Face, filmed: Filmed, where: dict[str, Any]) -> Footage:
    """A video as footage that a face can be drawn into.

    Args:
        face: whose code it gets.
        filmed: the video.
        where: ``file`` or ``utterance`` of the landmarks, for messages.

    Raises:
        DnnvssError: a face that cannot be put into footage, landmarks of another kind or of another picture, or no
            frame of them is usable.
    """
    model = talker_model(face)
    _check(model, filmed, where)
    try:
        code = encode_clip(model, filmed.images, filmed.points, filmed.valid, float(filmed.rate), filmed.source)
    except UnusableClipError as error:
        raise DnnvssError(error.problem, **where, remedy="Choose other footage, or track the video again") from error
    return Footage(filmed.images, code, filmed.rate, filmed.source, filmed.pixel)


def _check(face: ActiveAppearanceModel, filmed: Filmed, where: dict[str, Any]) -> None:
    """Refuse landmarks too few for the face, or outside the pictures in most frames."""
    points, images = filmed.points, filmed.images
    if points.shape[1] < face.layout.needed:
        raise DnnvssError(f"has {points.shape[1]} landmarks a frame, and the run's face needs {face.layout.needed}",
                          **where, remedy="Track the video with the labels of the run's corpus")
    points = points[filmed.valid][:, face.layout.rows]
    points = points[np.isfinite(points).all(axis=(1, 2))]
    width, height = images.shape[2], images.shape[1]
    outside = checkup.outside(points, (width, height), replace(checkup.LIMITS, outside=_OUTSIDE))
    if len(points) and outside.mean() > 0.5:
        (left, top), (right, bottom) = np.median(points.min(axis=1), axis=0), np.median(points.max(axis=1), axis=0)
        scale = "write what they are to be divided by as scale in landmarks.json beside it"
        raise DnnvssError(f"its landmarks reach from ({left:.0f}, {top:.0f}) to ({right:.0f}, {bottom:.0f}), and the "
                          f"pictures have {width} x {height} pixels", **where,
                          remedy=f"Track this very video, or {scale}" if "file" in where else
                          "Prepare the corpus again with the scale of its landmarks")
