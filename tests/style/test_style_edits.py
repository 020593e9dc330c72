"""Edited curves become keys: what was changed, where it was, with easing round it."""

import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.face.base import Gauge
from dnnvss.style import key_constraints
from dnnvss.style.edits import Change, changes_of, edited_keys
from dnnvss.timing import FrameClock, Tier

CLOCK = FrameClock(50)
NOW = np.sin(np.arange(40) / 5)
TIER = Tier("phones", [(1.0, 1.4, "P"), (1.4, 1.8, "AA")])


def changed(first: int, last: int, by: float) -> Change:
    """A curve that was moved from one frame up to another."""
    wanted = NOW.copy()
    wanted[first:last] += by
    return Change("open", NOW, wanted, float(np.ptp(NOW)))


def test_only_what_was_edited_becomes_keys() -> None:
    assert edited_keys([changed(0, 0, 1.0)], CLOCK, TIER) == []
    keys = edited_keys([changed(22, 25, 0.5)], CLOCK, TIER, easing=0)
    assert [round(key.time, 6) for key in keys] == [0.45, 0.47, 0.49]
    assert [key.low for key in keys] == pytest.approx(NOW[22:25] + 0.5, abs=1e-6)
    assert all(
        key.low == key.high and key.softness == 0 and key.phone == "AA" and key.index == 1
        for key in keys
    )
    assert keys[0].position == pytest.approx(0.125)


def test_easing_fades_the_difference_and_gives_way_the_more() -> None:
    keys = sorted(
        edited_keys([changed(20, 21, 1.0)], CLOCK, None, easing=0.08), key=lambda key: key.time
    )
    shares = [key.low - NOW[round(key.time * 50 - 0.5)] for key in keys]
    assert shares == pytest.approx([0.146447, 0.5, 0.853553, 1, 0.853553, 0.5, 0.146447], abs=1e-5)
    soft = [key.softness for key in keys]
    assert soft[3] == 0 and soft[0] > soft[1] > soft[2] > 0 and soft[2] == soft[4]
    assert keys[0].phone is None


def test_keys_hold_their_frames() -> None:
    keys = edited_keys([changed(10, 12, 0.5)], CLOCK, TIER, easing=0)
    held = key_constraints(keys, {"open": Gauge("open", np.array([1.0]), 0.0)}, CLOCK, 40, TIER)
    assert sorted(np.unique(held.frames).tolist()) == [10, 11]


def test_changes_are_what_differs_from_what_is_said_now() -> None:
    told = {"Open": NOW, "jawOpen": np.zeros(40)}
    edited = {"open": NOW + 1e-7, "jawOpen": np.where(np.arange(40) == 3, 0.5, 0), "gap": NOW}
    found = changes_of(
        edited, told, {"aperture": 10 * NOW}, {"jawOpen": {"aperture": 8.0}, "Open": {}}
    )
    assert np.flatnonzero(found[0].changed).tolist() == [3]
    assert found[0].wanted[3] == pytest.approx(10 * NOW[3] + 4.0)


def test_a_curve_that_is_shown_as_0_below_0_is_wanted_where_it_was_put() -> None:
    """Rounding is exported as 0 where the mouth is wide: 0.3 there is 0.3, not 0.3 above what it was."""
    own = np.array([-0.4, -0.4, 0.2, 0.2])
    shown, edited = np.maximum(own, 0), np.array([0.3, 0.0, 0.2, 0.0])
    (found,) = changes_of({"rounding": edited}, {"rounding": shown}, {"rounding": own}, {})
    assert found.wanted.tolist() == [0.3, -0.4, 0.2, 0.0]


def test_curves_of_something_else_are_told() -> None:
    with pytest.raises(DnnvssError, match="none of the curves smile is known"):
        changes_of({"smile": NOW}, {"open": NOW}, {"open": NOW}, {})
    with pytest.raises(DnnvssError, match="has 12 frames, and what is said now has 40"):
        changes_of({"open": NOW[:12]}, {"open": NOW}, {"open": NOW}, {})


def test_too_many_edits_are_told() -> None:
    long = np.zeros(30_000)
    with pytest.raises(DnnvssError, match="values were edited"):
        edited_keys([Change("open", long, long + 1, 1.0)], CLOCK, None)
