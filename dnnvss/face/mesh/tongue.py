"""A simple tongue: two more shapes of the head, and curves of them by phones."""

from collections.abc import Mapping
from functools import cache
from types import MappingProxyType

import numpy as np

from dnnvss.face.mesh.head import Head, packaged_head
from dnnvss.timing import FrameClock, Tier

TIP, BACK, OUT = "tongueTipUp", "tongueBackUp", "tongueOut"
_TIP_RISE, _BACK_RISE = 0.014, 0.010
"""Metres by which the tip reaches the ridge behind the upper teeth, and the back the palate."""
_PHONES: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        **{key: {TIP: 1.0} for key in ("T", "D", "N", "L")},
        **{key: {TIP: 0.6} for key in ("S", "Z", "SH", "ZH", "CH", "JH")},
        **{key: {TIP: 0.55, OUT: 0.25} for key in ("TH", "DH")},
        **{key: {BACK: 1.0} for key in ("K", "G", "NG")},
        **{key: {BACK: 0.4} for key in ("IY", "Y", "IH", "EY")},
        "R": {TIP: 0.45, BACK: 0.3},
        "ER": {TIP: 0.3, BACK: 0.3},
    }
)
"""Phone to how far it raises the tongue; others leave it."""
_MOVE = 0.05
"""Seconds of a movement from one phone to the next, half on either side of the edge."""


@cache
def speaking_head() -> Head:
    """The packaged head with two more shapes, which raise the tip and the back of the tongue."""
    head = packaged_head()
    tongue = head.mesh.of_part("tongue")
    z = head.mesh.vertices[tongue, 2]
    along = (z - z.min()) / np.ptp(z)
    shapes = np.zeros((2, len(head.mesh.vertices), 3), np.float32)
    shapes[0, tongue, 1] = _TIP_RISE * np.clip((along - 0.45) / 0.55, 0, 1) ** 2
    shapes[1, tongue, 1] = _BACK_RISE * np.exp(-(((along - 0.4) / 0.2) ** 2))
    return Head(
        head.mesh, (*head.names, TIP, BACK), np.concatenate([head.shapes, shapes]), head.curves
    )


def tongue_curves(phones: Tier, clock: FrameClock, frames: int) -> dict[str, np.ndarray]:
    """How far the tongue is raised and put out (F,) by the shapes' names.

    Args:
        phones: the phones tier; its start is time 0.
        clock, frames: of the curves.
    """
    times = clock.centres(frames) + phones.start
    curves = {name: np.zeros(frames) for name in (TIP, BACK, OUT)}
    for segment in phones:
        inside = _step((times - segment.start) / _MOVE) * _step((segment.end - times) / _MOVE)
        for name, height in _PHONES.get(segment.label, {}).items():
            curves[name] = np.maximum(curves[name], height * inside)
    return curves


def _step(x: np.ndarray) -> np.ndarray:
    return 0.5 - 0.5 * np.cos(np.pi * np.clip(x + 0.5, 0, 1))
