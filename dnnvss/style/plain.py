"""Curves in units that an artist knows: 0 at rest, 1 at the largest that the talker showed."""

from collections.abc import Mapping

import numpy as np

from dnnvss.face.base import APERTURE, LOWER_LIP, WIDTH, Face, Gauge
from dnnvss.style.talker import Talker

OPEN, JAW, LIP, ROUNDING, SPREAD = "open", "jaw", "lip_down", "rounding", "spread"
ONE_SIDED = (ROUNDING, SPREAD)
"""Two halves of one movement, the width of the mouth: each is shown as 0 where the other one is."""
_JAWS = ("face_oval", "jaw")
"""Contours whose lowest point is the chin."""
_USUAL = 3.0
"""Standard deviations beyond the mean that count as the largest, where what the talker reached was not kept."""


def plain_gauges(face: Face, talker: Talker) -> dict[str, Gauge]:
    """``open``, ``jaw``, ``lip_down``, ``rounding`` and ``spread``, as far as the face can show them.

    Each is a gauge of the face, moved and scaled: 0 is the talker at rest, 1 the largest in the
    talker's training frames, for the jaw three standard deviations beyond the mean. ``rounding`` and
    ``spread`` are the width, less and more.

    Args:
        face: of any kind.
        talker: whose rest and largest movements are taken.
    """
    rest = np.nan_to_num(talker.rest)
    made = {}
    for name, of, sign in (
        (OPEN, APERTURE, 1),
        (LIP, LOWER_LIP, 1),
        (ROUNDING, WIDTH, -1),
        (SPREAD, WIDTH, 1),
    ):
        if of in face.gauges:
            gauge = face.gauges[of]
            made[name] = _scaled(
                name, gauge, rest, sign * _largest(gauge, rest, face, talker, sign)
            )
    if (chin := chin_gauge(face)) is not None:
        made[JAW] = _scaled(JAW, chin, rest, _usual(chin, rest, face, 1))
    return {name: gauge for name, gauge in made.items() if gauge is not None}


def chin_gauge(face: Face) -> Gauge | None:
    """How low the chin is, in the face's unit; None where no contour runs round it."""
    rows = next((face.contours[name] for name in _JAWS if name in face.contours), ())
    if not len(rows):
        return None
    at_rest = face.points(np.zeros(len(face.names)))
    chin = max(rows, key=lambda row: at_rest[row, 1])
    return Gauge("chin", face.jacobian()[:, chin, 1], float(at_rest[chin, 1]), face.unit)


def _largest(gauge: Gauge, rest: np.ndarray, face: Face, talker: Talker, sign: int) -> float:
    """How far a gauge goes from rest to one side, at most, in the talker's frames."""
    spans: Mapping[str, tuple[float, float]] = talker.reach.spans if talker.reach else {}
    if gauge.name not in spans:
        return _usual(gauge, rest, face, sign)
    low, high = spans[gauge.name]
    own = float(gauge(rest))
    return high - own if sign > 0 else own - low


def _usual(gauge: Gauge, rest: np.ndarray, face: Face, sign: int) -> float:
    """How far a gauge goes from rest to one side, if it goes some standard deviations from its mean."""
    deviation = float(np.sqrt(((gauge.vector * face.deviations) ** 2).sum()))
    return max(sign * float(gauge.constant - gauge(rest)) + _USUAL * deviation, 0.0)


def _scaled(name: str, gauge: Gauge, rest: np.ndarray, largest: float) -> Gauge | None:
    """A gauge that is 0 at rest and 1 where another is by ``largest`` above its rest; None where it never moves."""
    if not abs(largest) > 1e-9:
        return None
    return Gauge(
        name,
        gauge.vector / largest,
        float(gauge.constant - gauge(rest)) / largest,
        unit="",
        rest=0.0,
    )
