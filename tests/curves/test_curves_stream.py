"""Streaming equals the offline solve, exactly at a full lag and closely at a short one."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from dnnvss import DnnvssError
from dnnvss.curves import STATIC, STATIC_DELTA, STATIC_DELTA_DELTA2, Windows, derivatives, mlpg
from dnnvss.curves.stream import Stream

FIVE_TAPS = Windows(("static", "slope"), ((1.0,), (-0.2, -0.1, 0.0, 0.1, 0.2)))


def run(stream, mean, variance, step):
    parts = [stream.push(mean[i : i + step], variance[i : i + step]) for i in range(0, len(mean), step)]
    return np.concatenate([*parts, stream.finish()]), [len(p) for p in parts]


@pytest.mark.parametrize("windows", [STATIC, STATIC_DELTA, STATIC_DELTA_DELTA2, FIVE_TAPS])
@pytest.mark.parametrize("frames", [1, 2, 5, 40])
@pytest.mark.parametrize("step", [1, 7])
def test_a_full_lag_is_the_offline_result(windows, frames, step):
    rng = np.random.default_rng(frames)
    mean, variance = rng.normal(size=(frames, len(windows), 3)), rng.uniform(0.1, 1, size=(frames, len(windows), 3))
    out, _ = run(Stream(3, lag=frames + 4, windows=windows), mean, variance, step)
    assert np.abs(out - mlpg(mean, variance, windows)).max() < 1e-10


def speech_like(seed, frames=600, columns=10):
    """A prediction like a model's on the built-in talker: too flat, streams that disagree, its residual variances."""
    rng = np.random.default_rng(seed)
    x = gaussian_filter1d(rng.normal(size=(frames, columns)), 4, axis=0)
    x /= x.std(axis=0)
    truth = derivatives(x)
    error = gaussian_filter1d(rng.normal(size=truth.shape), 3, axis=0)
    spread = truth.std(axis=0)
    mean = truth * np.array([0.9, 0.7, 0.4])[:, None] + 0.3 * error / error.std() * spread
    return mean, np.array([0.3, 0.011, 0.0028])[:, None] * spread[:1] ** 2


@pytest.mark.parametrize("seed", range(3))
def test_a_fifth_of_a_second_is_enough(seed):
    mean, variance = speech_like(seed)
    spread = np.broadcast_to(variance, mean.shape)
    offline = mlpg(mean, variance)
    out, counts = run(Stream(10, lag=19), mean, spread, 1)
    assert counts[:21] == [0] * 19 + [1, 1]  # the first frame comes with the 20th: 200 ms at 100 frames a second
    assert np.sqrt(((out - offline) ** 2).mean(axis=0) / offline.var(axis=0)).max() < 0.01
    shorter, _ = run(Stream(10, lag=8), mean, spread, 1)
    assert np.abs(shorter - offline).mean() > 3 * np.abs(out - offline).mean()


def test_streams_that_agree_need_no_future():
    x = np.random.default_rng(0).normal(size=(50, 2))
    out, _ = run(Stream(2, lag=4), derivatives(x), np.ones((50, 3, 2)), 3)
    assert np.abs(out - x).max() < 1e-10


def test_it_begins_anew_after_the_end():
    mean, variance = speech_like(0, 30)
    stream = Stream(10)
    first, _ = run(stream, mean, np.broadcast_to(variance, mean.shape), 5)
    second, _ = run(stream, mean, np.broadcast_to(variance, mean.shape), 30)
    assert np.allclose(first, second, atol=1e-12)
    assert stream.finish().shape == (0, 10)


def test_bad_input_is_refused():
    with pytest.raises(DnnvssError, match="lag of 1"):
        Stream(2, lag=1)
    with pytest.raises(DnnvssError, match="not finite"):
        Stream(2).push(np.full((1, 3, 2), np.nan), 1.0)
    with pytest.raises(DnnvssError, match="variance 0"):
        Stream(2).push(np.zeros((1, 3, 2)), 0.0)
