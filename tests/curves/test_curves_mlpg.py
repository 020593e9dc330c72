"""MLPG against a dense solve, its kernels against one another, its gradients, and what it refuses."""

import numpy as np
import pytest
import torch
from curves.curves_cases import dense_mlpg
from hypothesis import given, settings
from hypothesis import strategies as st

from dnnvss import DnnvssError
from dnnvss.curves import STATIC, STATIC_DELTA, STATIC_DELTA_DELTA2, Windows, derivatives, mlpg
from dnnvss.curves.banded import Lapack, Sweep
from dnnvss.curves.cyclic import CyclicReduction

FIVE_TAPS = Windows(("static", "slope", "bend"), ((1.0,), (-0.2, -0.1, 0.0, 0.1, 0.2), (0.3, 0.1, -0.8, 0.1, 0.3)))


class Cyclic:
    """The kernel of accelerators, on the processor."""

    def __init__(self, bands):
        self.factor = CyclicReduction(torch.from_numpy(bands))

    def solve(self, padded):
        return self.factor.solve(torch.from_numpy(padded)).numpy()


KERNELS = {"lapack": Lapack, "sweep": Sweep, "cyclic": Cyclic}


def use_kernel(monkeypatch, name):
    monkeypatch.setattr("dnnvss.curves.equations.factorise", lambda bands, batch=1: KERNELS[name](bands))


def test_two_frames_by_hand():
    """Two frames, static and delta, unit variances: (I + W1'W1) x = m0 + W1'm1 with W1 = [[-.5, .5], [-.5, .5]]."""
    mean = np.array([[[1.0], [0.0]], [[3.0], [0.0]]])
    # W1'W1 = [[.5, -.5], [-.5, .5]]; (1.5 x0 - .5 x1 = 1, -.5 x0 + 1.5 x1 = 3) gives x = (1.5, 2.5)
    assert np.allclose(mlpg(mean, 1.0, STATIC_DELTA), [[1.5], [2.5]], atol=1e-14)


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("windows", [STATIC, STATIC_DELTA, STATIC_DELTA_DELTA2, FIVE_TAPS])
@pytest.mark.parametrize("frames", [1, 2, 3, 4, 7, 40])
def test_equals_the_dense_solve(kernel, windows, frames, monkeypatch):
    use_kernel(monkeypatch, kernel)
    rng = np.random.default_rng(frames)
    mean = rng.normal(size=(frames, len(windows), 3))
    for shape in [(len(windows), 3), (frames, len(windows), 3), (3,), (frames, 1, 1), ()]:
        variance = 10 ** rng.uniform(-2, 2, size=shape)
        assert np.abs(mlpg(mean, variance, windows) - dense_mlpg(mean, variance, windows)).max() < 1e-9


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("windows", [STATIC_DELTA_DELTA2, FIVE_TAPS])
def test_ragged_rows_equal_each_row_alone(kernel, windows, monkeypatch):
    use_kernel(monkeypatch, kernel)
    rng = np.random.default_rng(7)
    lengths, widest = [9, 1, 2, 5], 9
    mean = rng.normal(size=(4, widest, len(windows), 2))
    for shape in [mean.shape, (len(windows), 2), (4, 1, 1, 2), (widest, len(windows), 2)]:
        variance = np.broadcast_to(rng.uniform(0.1, 2, size=shape), mean.shape)
        padded_mean, padded_variance = mean.copy(), variance.copy()
        for row, length in enumerate(lengths):
            padded_mean[row, length:], padded_variance[row, length:] = np.nan, 0.0
        x = mlpg(padded_mean, padded_variance, windows, lengths=lengths)
        y = mlpg(padded_mean, rng.uniform(0.1, 2, size=(len(windows), 2)), windows, lengths=np.array(lengths))
        assert np.isfinite(y).all()
        for row, length in enumerate(lengths):
            alone = dense_mlpg(mean[row, :length], variance[row, :length], windows)
            assert np.abs(x[row, :length] - alone).max() < 1e-9
            assert (x[row, length:] == 0).all()


def test_kernel_by_size_gives_one_answer():
    """A batch wide enough for the sweep across columns equals its rows solved one by one."""
    rng = np.random.default_rng(3)
    mean, variance = rng.normal(size=(20, 30, 3, 30)), rng.uniform(0.1, 1, size=(3, 30))
    alone = np.stack([mlpg(m, variance) for m in mean])
    assert np.abs(mlpg(mean, variance) - alone).max() < 1e-12
    assert np.abs(mlpg(mean.reshape(4, 5, 30, 3, 30), variance).reshape(alone.shape) - alone).max() < 1e-12
    per_row = np.broadcast_to(variance, mean.shape)
    assert np.abs(mlpg(mean, per_row) - alone).max() < 1e-12


@settings(deadline=None, max_examples=40)
@given(st.integers(1, 30), st.integers(0, 2**32 - 1))
def test_streams_of_a_trajectory_give_the_trajectory_back(frames, seed):
    """Deltas and MLPG share the edge rule, so consistent streams are solved exactly at any variance."""
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(frames, 2))
    variance = rng.uniform(0.05, 20, size=(frames, 3, 2))
    assert np.abs(mlpg(derivatives(x), variance) - x).max() < 1e-9


def test_infinite_variance_says_nothing():
    rng = np.random.default_rng(0)
    mean = rng.normal(size=(12, 3, 2))
    variance = np.ones((12, 3, 2))
    variance[:, 2] = np.inf
    assert np.allclose(mlpg(mean, variance), mlpg(mean[:, :2], 1.0, STATIC_DELTA), atol=1e-12)
    variance[1:11, 0] = np.inf  # a single static frame at each end and deltas between them still determine everything
    assert np.abs(mlpg(mean, variance) - dense_mlpg(mean, variance, STATIC_DELTA_DELTA2)).max() < 1e-9


@pytest.mark.parametrize("kernel", KERNELS)
def test_nothing_determined_is_an_error(kernel, monkeypatch):
    use_kernel(monkeypatch, kernel)
    variance = np.ones((3, 2))
    variance[0, 1] = np.inf
    with pytest.raises(DnnvssError, match="parameter 1 of row 0 is not determined"):
        mlpg(np.zeros((8, 3, 2)), variance)


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan])
def test_bad_variance_is_named(value):
    variance = np.ones((5, 3, 2))
    variance[3, 1, 0] = value
    with pytest.raises(DnnvssError, match=rf"variance {value} at row 0, frame 3, stream 1, parameter 0"):
        mlpg(np.zeros((5, 3, 2)), variance)


def test_bad_means_and_shapes_are_refused():
    mean = np.zeros((5, 3, 2))
    with pytest.raises(DnnvssError, match="not finite"):
        mlpg(np.where(np.arange(5)[:, None, None] == 2, np.nan, mean), 1.0)
    with pytest.raises(DnnvssError, match=r"not \(frames, 2 streams"):
        mlpg(mean, 1.0, STATIC_DELTA)
    with pytest.raises(DnnvssError, match="shape"):
        mlpg(mean[:0], 1.0)
    with pytest.raises(DnnvssError, match="does not fit means"):
        mlpg(mean, np.ones((4, 3, 2)))
    with pytest.raises(DnnvssError, match="lengths"):
        mlpg(mean[None], 1.0, lengths=[6])
    with pytest.raises(DnnvssError, match="int64"):
        mlpg(np.zeros((5, 3, 2), int), 1.0)


def test_kind_and_dtype_are_kept():
    mean = np.random.default_rng(0).normal(size=(30, 3, 2))
    single = mlpg(mean.astype(np.float32), np.float32(0.5))
    assert single.dtype == np.float32
    assert np.abs(single - mlpg(mean.astype(np.float32).astype(float), 0.5)).max() < 1e-6
    tensor = mlpg(torch.from_numpy(mean), torch.tensor(0.5))
    assert tensor.dtype == torch.float64 and np.array_equal(tensor.numpy(), mlpg(mean, 0.5))


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("lengths", [None, [5, 3]])
@pytest.mark.parametrize("shape", [(2, 5, 3, 1), (3, 1), (5, 1, 1), (2, 1, 1, 1)])
def test_gradients(kernel, lengths, shape, monkeypatch):
    use_kernel(monkeypatch, kernel)
    rng = torch.Generator().manual_seed(0)
    mean = torch.randn(2, 5, 3, 1, dtype=torch.float64, generator=rng, requires_grad=True)
    variance = (torch.rand(shape, dtype=torch.float64, generator=rng) + 0.3).requires_grad_()
    assert torch.autograd.gradcheck(lambda m, v: mlpg(m, v, lengths=lengths), (mean, variance))


def test_gradient_in_single_precision_and_without_batch():
    mean = torch.randn(9, 3, 2, generator=torch.Generator().manual_seed(1), requires_grad=True)
    mlpg(mean, torch.ones(3, 2)).square().sum().backward()
    single = mean.grad.clone()
    double = mean.detach().double().requires_grad_()
    mlpg(double, torch.ones(3, 2)).square().sum().backward()
    assert single.dtype == torch.float32
    assert (single - double.grad).abs().max() < 1e-5


def test_a_long_utterance_is_solved_in_linear_time():
    """100,000 frames: the middle equals a solve of its surroundings: influence dies out in tens of frames."""
    rng = np.random.default_rng(0)
    mean = rng.normal(size=(100_000, 3, 1))
    x = mlpg(mean, 1.0)
    near = mlpg(mean[49_800:50_200], 1.0)
    assert np.abs(x[49_950:50_050] - near[150:250]).max() < 1e-12


@pytest.mark.parametrize("lengths", [None, np.arange(3, 43)])
def test_a_batch_wider_than_the_cache_equals_its_rows(lengths):
    rng = np.random.default_rng(5)
    mean, variance = rng.normal(size=(40, 42, 3, 30)), rng.uniform(0.1, 1, size=(40, 42, 3, 30))
    x = mlpg(mean, variance, lengths=lengths)
    for b in (0, 26, 27, 39):
        own = 42 if lengths is None else lengths[b]
        np.testing.assert_allclose(x[b, :own], mlpg(mean[b, :own], variance[b, :own]), atol=1e-11)
        assert not x[b, own:].any()
    variance[33] = np.inf
    with pytest.raises(DnnvssError, match="row 33"):
        mlpg(mean, variance, lengths=lengths)
