"""Smoothing splines, Hermite and cubic interpolation, overlap averaging."""

import numpy as np
import pytest

from dnnvss import DnnvssError
from dnnvss.curves.splines import interpolate, overlap_average, smoothing_spline
from dnnvss.timing import FrameClock


@pytest.mark.parametrize(("hertz", "left"), [(8.0, 0.5), (4.0, 16 / 17), (16.0, 1 / 17)])
def test_the_cutoff_halves_and_its_neighbours_follow_the_formula(hertz, left):
    clock = FrameClock(100)
    wave = np.sin(2 * np.pi * hertz * clock.centres(400))[:, None]
    smooth = smoothing_spline(wave, clock, cutoff=8.0)
    gain = (smooth * wave)[100:300].sum() / (wave**2)[100:300].sum()
    assert gain == pytest.approx(left, abs=0.01)


def test_a_straight_line_passes_and_noise_is_taken_out():
    line = np.arange(50.0)[:, None] * [1.0, -2.0]
    assert np.abs(smoothing_spline(line, FrameClock(100), 2.0) - line).max() < 1e-9
    rng = np.random.default_rng(0)
    truth = np.sin(np.arange(300) / 15)[:, None]
    noisy = truth + 0.3 * rng.normal(size=truth.shape)
    assert np.abs(smoothing_spline(noisy) - truth).std() < 0.3 * np.abs(noisy - truth).std()
    short = np.ones((3, 2), np.float32)
    assert np.array_equal(smoothing_spline(short), short)
    with pytest.raises(DnnvssError, match="cutoff"):
        smoothing_spline(truth, None, 8.0)


def test_hermite_does_not_overshoot_and_cubic_does():
    times, values = np.arange(5.0), np.array([[0.0], [0.0], [1.0], [1.0], [1.0]])
    at = np.linspace(-1, 5, 601)
    hermite, cubic = (interpolate(times, values, at, kind) for kind in ("hermite", "cubic"))
    assert hermite.min() >= 0 and hermite.max() <= 1
    assert cubic.max() > 1.01
    for curve in (hermite, cubic):
        assert np.allclose(curve[[100, 200, 300, 400, 500]], values, atol=1e-12)
        assert curve[0] == values[0] and curve[-1] == values[-1]  # ends held
    assert interpolate(np.zeros(1), np.array([[7.0]]), at).ravel().tolist() == [7.0] * 601
    with pytest.raises(DnnvssError, match="increasing"):
        interpolate(np.zeros(2), np.zeros((2, 1)), at)
    with pytest.raises(DnnvssError, match="'quintic'"):
        interpolate(times, values, at, "quintic")


def test_overlap_average_by_hand():
    windows = np.array([[[1.0], [1.0], [1.0]], [[4.0], [4.0], [4.0]]])
    # triangle 1 2 1: frame 1 (2 * 1 + 1 * 4) / 3, frame 2 (1 * 1 + 2 * 4) / 3
    assert overlap_average(windows, np.array([0, 1]), 4).ravel().tolist() == [1.0, 2.0, 3.0, 4.0]
    assert overlap_average(windows, np.array([0, 1]), 4, "flat").ravel().tolist() == [1.0, 2.5, 2.5, 4.0]
    assert overlap_average(windows, np.array([-1, 1]), 3).ravel().tolist() == [1.0, 2.5, 4.0]


def test_overlap_average_of_consistent_windows_is_the_trajectory():
    x = np.random.default_rng(0).normal(size=(30, 2))
    starts = np.arange(-4, 30)
    padded = np.vstack([x[:1].repeat(5, 0), x, x[-1:].repeat(9, 0)])
    windows = np.stack([padded[s + 5 : s + 10] for s in starts])
    assert np.abs(overlap_average(windows, starts, 30) - x).max() < 1e-12
    with pytest.raises(DnnvssError, match="frame 5 is covered by no window"):
        overlap_average(windows[:1], np.array([0]), 30)
