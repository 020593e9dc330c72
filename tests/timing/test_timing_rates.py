"""Which rate time stamps tell, and which frame is shown when."""

from fractions import Fraction

import numpy as np
import pytest

from dnnvss.timing.rates import even_frames, is_steady, rate_of, rising

NTSC = Fraction(30000, 1001)


@pytest.mark.parametrize("count", [25, 62, 84, 300, 3000])
def test_ticks_of_a_600th_are_one_rate_however_long_the_clip(count: int) -> None:
    times = np.round(np.arange(count) / float(NTSC) * 600) / 600
    assert rate_of(times, [NTSC]) == NTSC and is_steady(times, NTSC)
    index, taken = even_frames(times, NTSC)
    assert index.tolist() == list(range(count)) and taken.all()


@pytest.mark.parametrize("rate", ["24000/1001", "25", "30", "50", "60000/1001", "12"])
def test_milliseconds_tell_the_rate_of_a_long_clip(rate: str) -> None:
    exact = Fraction(rate)
    times = np.round(np.arange(900) / float(exact), 3)
    assert rate_of(times) == exact


def test_an_unusual_constant_rate_is_itself() -> None:
    assert rate_of(np.arange(200) / 33) == 33
    assert rate_of(np.arange(200) / 33, [Fraction(33)]) == 33


def test_a_phone_that_jitters_about_its_rate_is_of_that_rate() -> None:
    rng = np.random.default_rng(0)
    for rate in (29.97, 30.0, 30.03):
        times = np.sort(np.arange(90) / rate + rng.normal(0, 0.002, 90))
        assert is_steady(times - times[0], Fraction(30))


def test_of_a_variable_rate_each_tick_shows_what_is_seen_in_its_middle() -> None:
    times = np.cumsum([0, *np.tile([1 / 30, 1 / 15], 30)])
    index, taken = even_frames(times, Fraction(25))
    wanted = np.arange(len(index)) / 25
    assert np.abs(times[index] - wanted).max() <= 1 / 20 + 1e-9 and taken.all()
    assert (np.diff(index) >= 0).all() and wanted[-1] == pytest.approx(times[-1], abs=0.041)


def test_a_gap_is_filled_and_told() -> None:
    times = np.concatenate([np.arange(25) / 25, 2 + np.arange(25) / 25])
    index, taken = even_frames(times, Fraction(25))
    assert len(index) == 75 and (~taken).sum() == pytest.approx(25, abs=3)
    assert index[:25].tolist() == list(range(25)) and index[50:].tolist() == list(range(25, 50))


def test_another_rate_drops_and_repeats_frames() -> None:
    index, taken = even_frames(np.arange(60) / 60, Fraction(30))
    assert index.tolist() == list(range(0, 60, 2)) and taken.all()
    index, _ = even_frames(np.arange(25) / 25, Fraction(50))
    assert np.bincount(index).max() == 2 and len(index) == 50


def test_stamps_that_are_absent_or_fall_give_way_to_the_rate() -> None:
    assert rising([None, 0.1, 0.2], Fraction(10)).tolist() == [0, 0.1, 0.2]
    assert rising([0.5, 0.4, 0.7], Fraction(10)).tolist() == [0, 0.1, 0.2]
    assert rising([1.4, 1.5, 1.7], Fraction(10)) == pytest.approx([0, 0.1, 0.3])


@pytest.mark.parametrize("wrong", [None, 1.1, 1e6, 0.0])
def test_one_stamp_amiss_leaves_the_others_where_they_are(wrong: float | None) -> None:
    """Frames at a variable rate, which a constant one would draw apart from their sound."""
    true = np.cumsum([0.9, 0.1, 0.1, 0.4, 0.1, 0.3, 0.1, 0.1, 0.2, 0.1, 0.1])
    stamps = [*true[:4].tolist(), wrong, *true[5:].tolist()]
    found = rising(stamps, Fraction(10)) + 0.9
    assert np.delete(found, 4) == pytest.approx(np.delete(true, 4)) and true[3] < found[4] < true[5]
    assert rising([*true[:10], None], Fraction(10)) + 0.9 == pytest.approx(true)
    joined = np.tile(np.arange(20) / 10, 2)[:-7]
    assert rising(joined.tolist(), Fraction(10)) == pytest.approx(np.arange(33) / 10)
    later = np.concatenate([np.arange(20), 36000 + np.arange(20)]) / 10
    assert rising(later.tolist(), Fraction(10)) == pytest.approx(np.arange(40) / 10)
