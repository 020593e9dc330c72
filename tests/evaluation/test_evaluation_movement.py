"""Lag, jerk, power, speed, warping and landmarks, by hand and by known signals."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from dnnvss import DnnvssError
from dnnvss.evaluation.movement import dtw, high_power, jerk, lag, landmark_error, speed
from dnnvss.timing import FrameClock

CLOCK = FrameClock(100)


@pytest.mark.parametrize("frames", [-8, 0, 3, 19])
def test_lag_is_found_and_its_sign_says_late(frames):
    x = gaussian_filter1d(np.random.default_rng(0).normal(size=500), 4)
    assert lag(x[100:400], x[100 - frames : 400 - frames], CLOCK) == pytest.approx(frames / 100, abs=5e-4)


def test_lag_between_frames():
    t = np.arange(400) / 100
    x, late = (np.sin(9 * (t - d)) + np.sin(23 * (t - d)) for d in (0.0, 0.034))
    assert lag(x, late, CLOCK) == pytest.approx(0.034, abs=1e-3)


def test_few_frames_that_match_by_chance_are_no_lag():
    """Words of a quarter of a second, predicted in time: at lags of 200 ms five frames are left to compare."""
    rng = np.random.default_rng(0)
    words, errors = (gaussian_filter1d(rng.normal(size=(300, 65)), 4, axis=1)[:, 20:45] for _ in range(2))
    lags = [lag(x, x + 0.5 * e, CLOCK) for x, e in zip(words, errors, strict=True)]
    assert np.mean(np.abs(lags) <= 0.04) > 0.88


def test_no_lag_without_movement_or_match():
    x = np.sin(np.arange(100.0))
    assert np.isnan(lag(x, np.zeros(100), CLOCK)) and np.isnan(lag(x[:2], x[:2], CLOCK))
    rising = np.arange(100.0)
    assert np.isnan(lag(rising, -rising, CLOCK))


def test_jerk_of_a_cubic_is_its_third_derivative():
    t = CLOCK.centres(50)
    assert jerk(np.stack([t**3, 2 * t**3], axis=1), CLOCK) == pytest.approx(6 * np.sqrt((1 + 4) / 2), rel=1e-6)
    assert np.isnan(jerk(np.zeros((3, 1)), CLOCK))


def test_power_above_the_cutoff():
    t = CLOCK.centres(400)
    slow, fast = np.sin(2 * np.pi * 3 * t), np.sin(2 * np.pi * 20 * t)
    assert high_power(slow[:, None] + 7, CLOCK) < 1e-6
    # amplitudes 1 and 1/2: power 1 and 1/4
    assert high_power((slow + 0.5 * fast)[:, None], CLOCK) == pytest.approx(0.2, abs=1e-3)
    assert high_power(np.stack([slow, fast], axis=1), CLOCK) == pytest.approx(0.5, abs=1e-3)
    assert np.isnan(high_power(np.ones((50, 1)), CLOCK)) and np.isnan(high_power(slow[:5, None], CLOCK))


def test_speed_inside_a_mask_by_hand():
    points = np.array([[[0.0, 0.0]], [[3.0, 4.0]], [[3.0, 4.0]], [[100.0, 0.0]]])  # steps of 5, 0 and far pixels
    mask = np.array([1, 1, 1, 0], bool)
    assert speed(points, CLOCK, mask) == pytest.approx(100 * np.sqrt(25 / 2))
    assert speed(np.array([[0.0, 0.0], [1.0, 3.0]]), CLOCK, np.ones(2, bool)) == pytest.approx(100 * np.sqrt(5))
    assert np.isnan(speed(points, CLOCK, np.zeros(4, bool)))


def brute_dtw(r, p, band):
    frames = len(r)
    best = {(-1, -1): (0.0, 0)}
    for i in range(frames):
        for j in range(frames):
            if abs(i - j) <= band:
                d = np.linalg.norm(r[i] - p[j])
                options = [best[k] for k in ((i - 1, j - 1), (i - 1, j), (i, j - 1)) if k in best]
                cost, count = min(options, key=lambda o: o[0])
                best[i, j] = (cost + d, count + 1)
    cost, count = best[frames - 1, frames - 1]
    return cost / count


@pytest.mark.parametrize("band", [0, 2, 30])
def test_dtw_equals_the_plain_recursion(band):
    rng = np.random.default_rng(band)
    r, p = rng.normal(size=(2, 25, 3))
    assert dtw(r, p, band) == pytest.approx(brute_dtw(r, p, band))


def test_dtw_forgives_a_delay_within_its_band():
    x = gaussian_filter1d(np.random.default_rng(0).normal(size=(120, 2)), 5, axis=0)
    late = np.concatenate([x[:1].repeat(6, 0), x[:-6]])
    assert dtw(x, x, 20) == 0
    assert dtw(x, late, 20) < 0.3 * np.linalg.norm(x - late, axis=1).mean() < 2 * dtw(x, late, 1)
    assert np.isnan(dtw(x[:0], x[:0], 3))
    with pytest.raises(DnnvssError, match="differ in size"):
        dtw(x, x[:5], 3)


def test_landmark_error_by_hand():
    reference = np.zeros((2, 2, 2))
    predicted = np.array([[[3.0, 4.0], [0.0, 1.0]], [[0.0, 0.0], [0.0, 0.0]]])
    assert landmark_error(reference, predicted).tolist() == [3.0, 0.0]
