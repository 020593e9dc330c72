"""Plain curves: 0 at rest, 1 at the largest, and linear, so that keys can hold them."""

import numpy as np
import pytest
from face.face_cases import LinearFace, rig

from dnnvss.face.base import Gauge
from dnnvss.style import Key, Talker, key_constraints
from dnnvss.style.plain import chin_gauge, plain_gauges
from dnnvss.style.rules import closure
from dnnvss.style.within import Reach
from dnnvss.timing import FrameClock, Tier

OPEN, WIDE = (
    Gauge("aperture", np.array([2.0, 0.0]), 3.0),
    Gauge("width", np.array([0.0, 4.0]), 40.0),
)
CHIN = np.zeros((2, 3, 2))
CHIN[0, 1, 1] = 5.0
FACE = LinearFace(
    np.array([[0.0, 0], [1, 9], [2, 1]]),
    CHIN,
    {"aperture": OPEN, "width": WIDE},
    {"jaw": [0, 1, 2]},
)
REACH = Reach(
    np.full(2, -9.0), np.full(2, 9.0), {}, {"aperture": (1.0, 11.0), "width": (30.0, 48.0)}
)
TALKER = Talker(np.ones(2), np.array([-1.0, 0.5]), np.ones(2), {}, {}, reach=REACH)


def test_rest_is_zero_and_the_largest_is_one() -> None:
    plain = plain_gauges(FACE, TALKER)
    assert set(plain) == {"open", "rounding", "spread", "jaw"}
    assert all(gauge(TALKER.rest) == pytest.approx(0) for gauge in plain.values())
    widest, narrowest, opened = np.array([0, 2.0]), np.array([0, -2.5]), np.array([4.0, 0])
    assert plain["spread"](widest) == pytest.approx(1) and plain["rounding"](
        narrowest
    ) == pytest.approx(1)
    assert plain["open"](opened) == pytest.approx(1)
    assert plain["rounding"](widest) < 0


def test_the_chin_is_the_lowest_point_of_the_jaw_and_three_deviations_from_the_mean_are_the_largest() -> None:
    """A talker rests with the jaw higher than on average: three deviations from rest are passed in every sentence."""
    chin = chin_gauge(FACE)
    assert chin is not None and chin(np.array([1.0, 0])) == 14
    assert plain_gauges(FACE, TALKER)["jaw"](np.array([3.0, 0])) == pytest.approx(1)


def test_without_a_range_three_deviations_are_the_largest_and_a_face_of_numbers_has_none() -> None:
    bare = Talker(np.ones(2), np.full(2, np.nan), np.ones(2), {}, {})
    assert plain_gauges(FACE, bare)["open"](np.array([3.0, 0])) == pytest.approx(1)
    assert plain_gauges(rig(2), bare) == {}


def test_a_key_in_plain_units_wins_over_a_closure_as_one_in_pixels_does() -> None:
    clock, tier = FrameClock(50), Tier("phones", [(0, 0.2, "AA"), (0.2, 0.4, "P"), (0.4, 0.6, "AA")])
    plain = plain_gauges(FACE, TALKER)
    rule = closure(2.0)
    assert len(rule.constraints(tier, clock, OPEN, 30).frames)
    for key in (Key(0.3, "open", 0.5, 0.5), Key(0.3, "aperture", 7.0, 7.0)):
        held = key_constraints([key], {**plain, "aperture": OPEN}, clock, 30)
        assert not len(rule.constraints(tier, clock, OPEN, 30, held).frames)
    agrees = key_constraints([Key(0.3, "open", 0.0, 0.0)], plain, clock, 30)
    assert len(rule.constraints(tier, clock, OPEN, 30, agrees).frames), "0 is rest, an aperture of 1"
