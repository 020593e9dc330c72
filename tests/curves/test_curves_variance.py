"""The articulation dial and the global-variance term."""

import numpy as np
import pytest
from curves.curves_cases import dense_normal_matrix
from scipy.optimize import minimize

from dnnvss import DnnvssError
from dnnvss.curves import STATIC_DELTA, STATIC_DELTA_DELTA2, derivatives, mlpg
from dnnvss.curves.variance import GlobalVariance, articulate, dial, with_global_variance


def test_statistics_by_hand():
    # variances of (0, 2), (0, 4), (0, 0): 1, 4, 0; mean 5/3; squared deviations 4/9 + 49/9 + 25/9 = 78/9, over 2
    statistics = GlobalVariance.of([np.array([[0.0], [a]]) for a in (2.0, 4.0, 0.0)])
    assert statistics.mean == pytest.approx(5 / 3) and statistics.variance == pytest.approx(78 / 18)
    masks = [np.array([True, True, False])] * 2
    cut = GlobalVariance.of([np.array([[0.0], [2.0], [99.0]])] * 2, masks)
    assert cut.mean == pytest.approx(1.0)
    with pytest.raises(DnnvssError, match="1 utterances"):
        GlobalVariance.of([np.zeros((4, 1))])


def test_the_dial_sets_the_variance_and_keeps_the_mean():
    x = np.random.default_rng(0).normal(size=(200, 3)) * [1, 2, 3] + [5, -5, 0]
    natural = np.array([4.0, 4.0, 1.0])
    for setting in (0.0, 0.5, 1.0, 1.7):
        out = articulate(x, setting, natural)
        assert np.allclose(out.var(axis=0), setting**2 * natural) and np.allclose(out.mean(axis=0), x.mean(axis=0))
    fixed = articulate(x, 1.0, natural, own=np.array([1.0, 4.0, 9.0]))
    assert np.allclose(fixed.std(axis=0), x.std(axis=0) * [2, 1, 1 / 3])


def test_the_dial_over_speech_only_and_about_a_centre():
    x = np.array([[100.0], [0.0], [2.0], [100.0]])
    speech = np.array([0, 1, 1, 0], bool)
    assert articulate(x, 1.0, np.array([4.0]), mask=speech)[1:3].ravel().tolist() == [-1.0, 3.0]
    about = articulate(x, 1.0, np.array([4.0]), mask=speech, centre=np.array([0.0]))
    assert about[1:3].ravel().tolist() == [0.0, 4.0]


def test_what_does_not_move_stays():
    still = np.full((5, 1), 3.0)
    assert np.array_equal(articulate(still, 1.0, np.array([4.0])), still)
    barely = still + 1e-6 * np.arange(5)[:, None]
    assert np.array_equal(articulate(barely, 1.0, np.array([4.0]), own=np.array([1e-9])), barely)


def test_groups():
    groups = {"jaw": [0, 2], "lips": [1]}
    assert dial(4, 1.0, groups, jaw=0.5, lips=1.5).tolist() == [0.5, 1.5, 0.5, 1.0]
    with pytest.raises(DnnvssError, match=r"'tongue'.*jaw"):
        dial(4, 1.0, groups, tongue=1.0)
    with pytest.raises(DnnvssError, match=r"-0\.5"):
        dial(4, -0.5)


@pytest.mark.parametrize("windows", [STATIC_DELTA, STATIC_DELTA_DELTA2])
@pytest.mark.parametrize("wanted", [0.2, 3.0])
@pytest.mark.parametrize("weight", [0.01, 1.0])
def test_global_variance_equals_a_general_optimiser(windows, wanted, weight):
    rng = np.random.default_rng(1)
    frames = 20
    variance = rng.uniform(0.1, 1, size=(frames, len(windows), 1))
    x0 = mlpg(rng.normal(size=variance.shape), variance, windows)
    target = GlobalVariance(np.array([wanted]), np.array([0.3]))
    normal = dense_normal_matrix(variance, windows)

    def cost(x):
        d, v = x - x0[:, 0], x.var()
        slope = 2 * normal @ d / (len(windows) * frames) + weight * 2 * (v - wanted) / 0.3 * 2 / frames * (x - x.mean())
        return d @ normal @ d / (len(windows) * frames) + weight * (v - wanted) ** 2 / 0.3, slope

    best = minimize(cost, x0[:, 0], jac=True, method="BFGS", options={"gtol": 1e-10, "maxiter": 2000}).x
    ours = with_global_variance(x0, variance, target, weight, windows)[:, 0]
    assert cost(ours)[0] <= cost(best)[0] + 1e-9
    assert np.abs(cost(ours)[1]).max() < 1e-7
    assert np.abs(ours - best).max() < 1e-4


@pytest.mark.parametrize("frames", [2, 3, 60, 120])
@pytest.mark.parametrize("growth", [0.5, 1.5, 3.0])
def test_global_variance_is_found_where_the_mean_is_what_is_held_least(frames, growth):
    """A slow movement that must grow: the matrix is definite only without the mean."""
    t = np.arange(frames) / 100
    mean = derivatives(0.6 * (np.sin(6 * np.pi * t + 1) + 0.7 * np.sin(10 * np.pi * t))[:, None])
    variance = np.array([0.5, 1e-3, 1e-4])[:, None] * np.ones((frames, 1, 1))
    x0 = mlpg(mean, variance)
    wanted = growth * x0.var()
    normal = dense_normal_matrix(variance, STATIC_DELTA_DELTA2)

    def cost(x):
        d, v, spread = x - x0[:, 0], x.var(), (0.2 * wanted) ** 2
        slope = 2 * normal @ d / (3 * frames) + 2 * (v - wanted) / spread * 2 / frames * (x - x.mean())
        return d @ normal @ d / (3 * frames) + (v - wanted) ** 2 / spread, slope

    x = with_global_variance(x0, variance, GlobalVariance(np.array([wanted]), np.array([(0.2 * wanted) ** 2])))[:, 0]
    best = minimize(cost, x0[:, 0] * np.sqrt(growth), jac=True, method="L-BFGS-B", options={"maxiter": 5000}).fun
    assert cost(x)[0] <= best * (1 + 1e-6) and cost(x)[0] < cost(x0[:, 0])[0]
    assert np.abs(cost(x)[1]).max() < 1e-6 * np.abs(cost(x0[:, 0])[1]).max()


def test_without_weight_the_trajectory_is_the_same():
    x0 = np.random.default_rng(0).normal(size=(9, 2))
    target = GlobalVariance(np.ones(2), np.ones(2))
    assert with_global_variance(x0, 1.0, target, 0.0) is x0
    assert with_global_variance(x0[:1], 1.0, target) is not None
    heavy = with_global_variance(x0, 1.0, target, 1e6)
    assert heavy.var(axis=0) == pytest.approx([1, 1], abs=1e-4)
