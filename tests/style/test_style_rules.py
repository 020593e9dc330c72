"""Rules from phones, rest in silence, and keys that survive."""

import json

import numpy as np
import pytest

from dnnvss import DnnvssError
from dnnvss.curves import derivatives, mlpg
from dnnvss.curves.constraints import constrain, hold
from dnnvss.face.base import Gauge
from dnnvss.style.keys import Key, coefficients, key_constraints, read_keys, sample_keys, write_keys
from dnnvss.style.rules import (
    closure,
    level,
    phone_extremes,
    phone_frames,
    rest_in_silence,
    silent_frames,
    teeth_contact,
)
from dnnvss.timing import FrameClock, Tier

CLOCK = FrameClock(100)
TIER = Tier("phones", [(0, 0.2, "sil"), (0.2, 0.28, "B"), (0.28, 0.48, "AY"), (0.48, 0.54, "F"), (0.54, 0.545, "P"),
                       (0.545, 0.8, "sil")])


APERTURE = Gauge("aperture", np.array([1.0, -0.5]), 2.0)
"""2 pixels at rest, growing with the first coefficient."""


def prediction(frames=80):
    rng = np.random.default_rng(0)
    return rng.normal(size=(frames, 3, 2)) * np.array([1, 0.3, 0.3])[:, None], np.array([1, 0.2, 0.1])[:, None]


def test_frames_of_a_part_of_a_phone():
    found = phone_frames(TIER, CLOCK, ("B", "P"), 80, (0.25, 0.75))
    assert [(s.label, at.tolist()) for s, at in found] == [("B", [22, 23, 24, 25]), ("P", [54])]  # P owns no frame
    whole = phone_frames(TIER, CLOCK, ("AY",), 80)
    assert whole[0][1].tolist() == list(range(28, 48))
    assert phone_frames(TIER, CLOCK, ("B",), 10) == []


def test_closure_holds_and_leaves_the_rest_nearly_alone():
    mean, variance = prediction()
    x0 = mlpg(mean, variance)
    rule = closure(0.5)
    constraints = rule.constraints(TIER, CLOCK, APERTURE, 80)
    assert len(constraints) == 5 and constraints.labels[0] == "lip closure on B at 0.20 s"
    x = constrain(x0, variance, constraints)
    apertures = APERTURE(x)
    assert apertures[[22, 23, 24, 25, 54]].max() < 0.5 + 1e-9
    assert np.abs(x - x0)[70:].max() < 0.05 * np.abs(x - x0).max()
    contact = teeth_contact(1.0, part=(0.0, 1.0)).constraints(TIER, CLOCK, APERTURE, 80)
    assert set(contact.frames) == set(range(48, 54))


def test_a_contact_gives_way_where_the_caller_holds_something_else():
    """Only in the phone that has a key, by the rule's own softness there; a key elsewhere leaves it hard."""
    contact = teeth_contact(1.0, beside=0.4)
    key = [hold([frame], np.array([0.0, 1.0]), low=2.0) for frame in (51, 10)]
    inside, outside = (contact.constraints(TIER, CLOCK, APERTURE, 80, first) for first in key)
    assert set(inside.softness) == {0.4} and set(outside.softness) == {0.0}
    assert set(closure(0.5).constraints(TIER, CLOCK, APERTURE, 80, key[0]).softness) == {0.0}


def test_levels_of_the_talker():
    values = np.arange(80.0)
    assert phone_extremes(TIER, CLOCK, ("B", "P"), values).tolist() == [20, 54]
    assert phone_extremes(TIER, CLOCK, ("AY",), values, lowest=False).tolist() == [47]
    assert level([np.array([1.0, 2.0]), np.array([3.0])], 0.5) == 2.0
    with pytest.raises(DnnvssError, match="never spoke"):
        level([np.zeros(0)])


def test_silence_less_anticipation_and_release():
    assert np.flatnonzero(silent_frames(TIER, CLOCK, 80)).tolist() == [*range(20), *range(55, 80)]  # 0.545 s rounds up
    mask = silent_frames(TIER, CLOCK, 80, anticipation=0.05, release=0.1)
    assert np.flatnonzero(mask).tolist() == [*range(15), *range(65, 80)]


def test_silences_beside_each_other_are_one():
    """A short pause and a silence: 0.15 s after speech and before it are free, wherever the edge between them lies."""
    split = Tier("phones", [(0, 0.5, "AA"), (0.5, 0.55, "sp"), (0.55, 1, "sil"), (1, 1.05, "sp"), (1.05, 1.3, "AA")])
    whole = Tier("phones", [(0, 0.5, "AA"), (0.5, 1.05, "sil"), (1.05, 1.3, "AA")])
    free = [np.flatnonzero(silent_frames(tier, FrameClock(100), 130, 0.15, 0.15)).tolist() for tier in (split, whole)]
    assert free[0] == free[1] == list(range(65, 90))


def test_rest_is_reached_in_silence_and_nowhere_else():
    mean, variance = prediction()
    rest = np.array([3.0, -3.0])
    pulled = rest_in_silence(mean, variance, TIER, CLOCK, rest, 0.05, anticipation=0.05, release=0.05)
    x, x0 = mlpg(*pulled), mlpg(mean, variance)
    assert np.abs(x[:10] - rest).max() < 0.1 and np.abs(x[70:] - rest).max() < 0.1
    assert np.abs(x[36:40] - x0[36:40]).max() < 0.02 * np.abs(x - x0).max()
    gentle = rest_in_silence(mean, variance, TIER, CLOCK, rest, 1e6)
    assert np.abs(mlpg(*gentle) - x0).max() < 1e-6
    with pytest.raises(DnnvssError, match="positive"):
        rest_in_silence(mean, variance, TIER, CLOCK, rest, 0.0)


def test_rest_by_hand_in_one_frame():
    """Observation 0 of variance 1 and rest 4 of deviation 1 meet at 2, with variance 1/2."""
    tier = Tier("phones", [(0, 0.01, "sil")])
    mean, variance = rest_in_silence(np.zeros((1, 1, 1)), np.ones((1, 1)), tier, CLOCK, np.array([4.0]), 1.0)
    assert mean.item() == 2.0 and variance.item() == 0.5


@pytest.mark.parametrize("suffix", [".csv", ".json"])
def test_keys_survive_a_file_an_edit_and_another_tempo(tmp_path, suffix):
    mean, variance = prediction()
    gauges = {"aperture": APERTURE, **coefficients(("aam01", "aam02"))}
    x0 = mlpg(mean, variance)
    keys = sample_keys(x0, CLOCK, gauges, TIER)
    assert len(keys) == 6 * 3
    back = read_keys(write_keys(tmp_path / f"keys{suffix}", keys))
    assert back == keys
    edited = [Key(**{**vars(k), "low": 6.0, "high": 6.0}) for k in back if k.phone == "AY" and k.name == "aperture"]
    slow = Tier("phones", [(2 * a, 2 * b, label) for a, b, label in TIER])  # said at half the speed
    again = mlpg(np.repeat(mean, 2, axis=0), variance)
    constraints = key_constraints(edited, gauges, CLOCK, 160, slow)
    assert constraints.frames.tolist() == [76]
    assert APERTURE(constrain(again, variance, constraints))[76] == pytest.approx(6.0, abs=1e-9)
    fixed = key_constraints(edited, gauges, CLOCK, 160)
    assert fixed.frames.tolist() == [38]


def test_unedited_keys_leave_the_trajectory_alone():
    mean, variance = prediction()
    gauges = {"aperture": APERTURE}
    x0 = mlpg(mean, variance)
    constraints = key_constraints(sample_keys(x0, CLOCK, gauges, TIER), gauges, CLOCK, 80, TIER)
    assert np.abs(constrain(x0, variance, constraints) - x0).max() < 1e-5  # keys are written with six decimals


def test_ranges_over_time_and_open_bounds(tmp_path):
    (tmp_path / "keys.csv").write_text("time,name,low,high,end\n0.30,aperture,3,,0.33\n", encoding="utf-8")
    keys = read_keys(tmp_path / "keys.csv")
    assert keys == [Key(0.3, "aperture", 3.0, np.inf, end=0.33)]
    x = derivatives(np.zeros((80, 2)))
    constraints = key_constraints(keys, {"aperture": APERTURE}, CLOCK, 80)
    out = APERTURE(constrain(mlpg(x, 1.0), 1.0, constraints))
    assert out[30:34] == pytest.approx(3.0) and out[0] == pytest.approx(2.0, abs=1e-4)
    (tmp_path / "keys.json").write_text(json.dumps([{"time": 0.3, "name": "aperture", "value": 3}]), encoding="utf-8")
    assert read_keys(tmp_path / "keys.json") == [Key(0.3, "aperture", 3.0, 3.0)]


def test_keys_that_cannot_be_held_are_named(tmp_path):
    gauges = {"aperture": APERTURE}
    with pytest.raises(DnnvssError, match=r"'jaw'.*aperture"):
        key_constraints([Key(0.1, "jaw", 0, 0)], gauges, CLOCK, 80)
    with pytest.raises(DnnvssError, match=r"0\.9 s lies outside"):
        key_constraints([Key(0.9, "aperture", 0, 0)], gauges, CLOCK, 80)
    with pytest.raises(DnnvssError, match=r"position 9\.5 in phone 1, B\) lies outside.*from 0"):
        key_constraints([Key(0.1, "aperture", 0, 0, phone="B", index=1, position=9.5)], gauges, CLOCK, 80, TIER)
    with pytest.raises(DnnvssError, match=r"anchored to 'P'.*'B' now"):
        key_constraints([Key(0.1, "aperture", 0, 0, phone="P", index=1)], gauges, CLOCK, 80, TIER)
    for text, match in [("time,name\n0.1,aperture\n", "neither a value"), ("time,name,low\nx,aperture,1\n", "key 1"),
                        ("time,name,low,colour\n0.1,aperture,1,red\n", "'colour'")]:
        (tmp_path / "keys.csv").write_text(text, encoding="utf-8")
        with pytest.raises(DnnvssError, match=rf"keys\.csv.*{match}"):
            read_keys(tmp_path / "keys.csv")
    with pytest.raises(DnnvssError, match=r"\.csv or \.json"):
        write_keys(tmp_path / "keys.txt", [])
