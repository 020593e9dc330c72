"""The smoothing spline."""

import numpy as np
import pytest

from dnnvss import DnnvssError
from dnnvss.curves.splines import smoothing_spline
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
