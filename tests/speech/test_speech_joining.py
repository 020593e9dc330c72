"""Stretches of recordings become one sound: its length, itself where nothing is cut, no clicks at joins."""

import numpy as np
import pytest

from dnnvss.speech.joining import Stretch, joined

RATE = 16000


def tone(hertz: float, phase: float, seconds: float = 0.5) -> np.ndarray:
    return np.sin(2 * np.pi * hertz * np.arange(round(seconds * RATE)) / RATE + phase).astype(np.float32)


def test_parts_of_one_recording_that_follow_each_other_are_the_recording() -> None:
    sound = np.random.default_rng(0).normal(size=8000).astype(np.float32)
    parts = [Stretch(sound, 500, 2000), Stretch(sound, 2000, 4100), Stretch(sound, 4100, 7000)]
    np.testing.assert_allclose(joined(parts, RATE), sound[500:7000], atol=1e-6)


@pytest.mark.parametrize("phase", [0.0, 1.0, 2.5, np.pi, 5.0])
def test_waves_that_do_not_meet_are_moved_until_they_do(phase: float) -> None:
    parts = [Stretch(tone(130, 0), 1000, 3000), Stretch(tone(130, phase), 3000, 5500)]
    made = joined(parts, RATE)
    assert len(made) == 4500
    steepest = 2 * np.pi * 130 / RATE
    assert np.abs(np.diff(made)).max() < 1.05 * steepest
    loud = np.sqrt(np.convolve(made**2, np.ones(250) / 250, "valid"))
    assert loud.min() > 0.66, "no dip in loudness where they are faded over"


def test_short_stretches_and_ends_of_recordings() -> None:
    one, two, three = (tone(200, phase, 0.1) for phase in (0, 1, 2))
    made = joined([Stretch(one, 0, 800), Stretch(two, 500, 520), Stretch(three, 0, 1600)], RATE)
    assert len(made) == 800 + 20 + 1600 and np.isfinite(made).all() and np.abs(made).max() < 1.3
    assert len(joined([Stretch(np.ones(10, np.float32), 5, 30)], RATE)) == 25
    assert joined([Stretch(np.ones(10, np.float32), 8, 14)], RATE).tolist() == [1, 1, 0, 0, 0, 0]
