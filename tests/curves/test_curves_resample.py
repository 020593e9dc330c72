"""Resampling: exact on cubics, centres, held ends, no drift."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from dnnvss import DnnvssError
from dnnvss.curves import resample
from dnnvss.timing import FrameClock


def test_a_cubic_is_reproduced_at_its_centres():
    def cubic(seconds):
        return np.stack([1 + seconds - 3 * seconds**2 + seconds**3, -seconds], axis=1)

    source, target = FrameClock(25), FrameClock(100)
    out = resample(cubic(source.centres(50)), source, target)
    assert out.shape == (200, 2)
    inside = slice(2, -2)  # source centres begin at 0.02 s, target centres at 0.005 s: two frames at each end are held
    assert np.abs(out - cubic(target.centres(200)))[inside].max() < 1e-12
    assert np.array_equal(out[0], cubic(source.centres(1))[0]) and np.array_equal(out[0], out[1])


def test_same_rate_is_the_same_trajectory():
    x = np.random.default_rng(0).normal(size=(10, 3)).astype(np.float32)
    out = resample(x, FrameClock(25), FrameClock(25))
    assert out.dtype == np.float32 and np.array_equal(out, x)


@pytest.mark.parametrize(
    ("source", "target"), [("25", "29.97"), ("100", "29.97"), ("29.97", "100"), ("30", "60000/1001")]
)
def test_no_drift_over_ten_minutes(source, target):
    """Time itself, sampled at the source's centres, comes back as the target's centres to a nanosecond."""
    source, target = FrameClock(source), FrameClock(target)
    frames = int(600 * source.rate)
    out = resample(source.centres(frames)[:, None], source, target)[:, 0]
    assert len(out) == round(Fraction(frames) * target.rate / source.rate)
    centres = np.clip(target.centres(len(out)), source.centres(1)[0], source.centres(frames)[-1])
    assert np.abs(out - centres).max() < 1e-9


def test_there_and_back_keeps_slow_movement():
    clock, fine = FrameClock(25), FrameClock(100)
    x = np.sin(2 * np.pi * 2 * clock.centres(100))[:, None]
    back = resample(resample(x, clock, fine), fine, clock)
    assert np.abs(back - x)[3:-3].max() < 1e-3


def test_short_ones_and_counts():
    assert resample(np.array([[5.0]]), FrameClock(25), FrameClock(100)).tolist() == [[5.0]] * 4
    assert resample(np.array([[0.0], [1.0]]), FrameClock(25), FrameClock(25), count=3).tolist() == [[0.0], [1.0], [1.0]]
    assert resample(np.array([[0], [4]]), FrameClock(1), FrameClock(2))[:, 0].tolist() == [0.0, 1.0, 3.0, 4.0]
    assert len(resample(np.zeros((1, 2)), FrameClock(100), FrameClock(25))) == 1


def test_empty_and_nan_are_refused():
    for bad in (np.zeros((0, 2)), np.array([[np.nan], [1.0]])):
        with pytest.raises(DnnvssError, match="empty or not finite"):
            resample(bad, FrameClock(25), FrameClock(100))


@pytest.mark.parametrize("frames", [2, 3, 4, 5, 6, 40, 700])
def test_the_spline_is_the_one_of_scipy(frames):
    x = np.random.default_rng(frames).normal(size=(frames, 2, 3))
    source, target = FrameClock(100), FrameClock(30)
    out = resample(x, source, target, count=3 * frames // 10 + 1)
    at = np.clip(target.centres(len(out)) * 100 - 0.5, 0, frames - 1)
    np.testing.assert_allclose(out, CubicSpline(np.arange(frames), x, axis=0)(at), atol=1e-12)
