"""Constraints: by hand, against a dense KKT solve, against a general optimiser's conditions, and what is refused."""

from functools import cache

import numpy as np
import pytest
from curves.curves_cases import dense_normal_matrix

from dnnvss import DnnvssError
from dnnvss.curves import STATIC, STATIC_DELTA, STATIC_DELTA_DELTA2, mlpg
from dnnvss.curves.constraints import Constraints, constrain, equations_of, hold


def problem(frames=40, columns=3, seed=0, windows=STATIC_DELTA_DELTA2):
    rng = np.random.default_rng(seed)
    mean = rng.normal(size=(frames, len(windows), columns))
    variance = rng.uniform(0.05, 0.6, size=mean.shape)
    return rng, mlpg(mean, variance, windows), variance


def test_one_frame_by_hand():
    """Nearest point to (0, 0) with x + 2 y = 5, x four times as loose: x = 4 u, y = 2 u, 8 u = 5."""
    x = constrain(np.zeros((1, 2)), np.array([[4.0, 1.0]]), hold([0], np.array([1.0, 2.0]), value=5.0), STATIC)
    assert np.allclose(x, [[2.5, 1.25]], atol=1e-12)


def test_solves_that_share_their_equations_give_the_same() -> None:
    _, x0, variance = problem()
    shared = cache(lambda: equations_of(variance, x0.shape, STATIC_DELTA_DELTA2))
    rows = [hold([3, 9, 20], np.ones(3), value=1.0), hold([9, 21], np.array([0.0, 1.0, 0.0]), value=-1.0)]
    for wanted in (rows[:1], rows):
        joined = Constraints.joined(wanted)
        alone = constrain(x0, variance, joined)
        np.testing.assert_allclose(constrain(x0, variance, joined, equations=shared), alone, rtol=0, atol=1e-12)


def test_a_range_pushes_only_as_far_as_its_bound():
    x0 = np.array([[3.0], [0.5], [-3.0]])
    x = constrain(x0, 1.0, hold([0, 1, 2], np.ones(1), low=-1.0, high=1.0), STATIC)
    assert np.allclose(x, [[1.0], [0.5], [-1.0]], atol=1e-12)


def test_a_soft_one_weighs_like_an_observation():
    """Prediction 0 with variance 1, constraint 6 with deviation 2: the mean weighted 1 : 1/4 is 6 / 5."""
    x = constrain(np.zeros((1, 1)), 1.0, hold([0], np.ones(1), value=6.0, softness=2.0), STATIC)
    assert np.allclose(x, 1.2, atol=1e-12)


def test_a_key_is_met_to_rounding_beside_a_range_that_gives_way_almost_freely():
    """What a soft range adds to the diagonal is 1e14 times what neighbouring keys weigh; neither is blurred by it."""
    _, x0, variance = problem()
    keys = hold([10, 11, 12, 13], np.array([1e-3, 0.0, 0.0]), value=1e-2, label="key")
    free = hold([20, 21], np.ones(3), high=-5.0, softness=1e4, label="range")
    x = constrain(x0, variance, Constraints.joined([keys, free]))
    assert np.abs(x[10:14, 0] * 1e-3 - 1e-2).max() < 1e-12
    assert np.abs(x[30:] - x0[30:]).max() < 0.1


@pytest.mark.parametrize("windows", [STATIC_DELTA, STATIC_DELTA_DELTA2])
@pytest.mark.parametrize("frames", [1, 2, 5, 60])
def test_equalities_equal_the_dense_kkt_solve(windows, frames):
    rng, x0, variance = problem(frames, 3, frames, windows)
    at = rng.permutation(frames)[: max(1, frames // 3)]
    parts = [hold([int(t)], rng.normal(size=3), constant=rng.normal(), value=rng.normal()) for t in at]
    if frames > 2:
        parts.append(hold([0, frames - 1], rng.normal(size=3), value=0.3, stream=1))
    constraints = Constraints.joined(parts)
    a, b = constraints.matrix(frames, windows).toarray(), constraints.low
    normal = dense_normal_matrix(variance, windows)
    kkt = np.block([[normal, a.T], [a, np.zeros((len(a), len(a)))]])
    dense = np.linalg.solve(kkt, np.concatenate([normal @ x0.ravel(), b]))[: x0.size].reshape(x0.shape)
    assert np.abs(constrain(x0, variance, constraints, windows) - dense).max() < 1e-9


def mixed(rng, frames, columns):
    return Constraints.joined([
        hold([3, 4, 5], rng.normal(size=columns), 0.3, value=1.0, label="key"),
        hold(range(10, 20), rng.normal(size=columns), low=-0.1, high=0.2, label="range"),
        hold([30, 31], rng.normal(size=columns), value=2.0, softness=0.5, label="soft"),
        hold([0, frames - 1], rng.normal(size=columns), value=0.0, stream=1, label="still"),
        hold(range(frames), rng.normal(size=columns), high=0.5, label="ceiling"),
        hold(range(0, frames, 2), rng.normal(size=columns), low=0.0, softness=0.2, label="soft floor"),
    ])


def violations(c, trajectory):
    """By how much each functional lies outside its range, zero inside."""
    values = c.matrix(len(trajectory), STATIC_DELTA_DELTA2) @ np.asarray(trajectory).ravel()
    return np.maximum(np.maximum(c.low - values, values - c.high), 0.0)


@pytest.mark.parametrize("seed", range(5))
def test_conditions_of_the_optimum(seed):
    """All kinds at once: stationarity, feasibility and signs of the multipliers certify the one minimum."""
    rng, x0, variance = problem(40, 3, seed)
    c = mixed(rng, 40, 3)
    x = constrain(x0, variance, c)
    hard = c.softness == 0
    assert violations(c, x)[hard].max() < 1e-9
    a = c.matrix(40, STATIC_DELTA_DELTA2).toarray()
    values = a @ x.ravel()
    force = dense_normal_matrix(variance, STATIC_DELTA_DELTA2) @ (x - x0).ravel()
    pull = np.clip(values, c.low, c.high) - values
    force -= a[~hard].T @ (pull[~hard] / c.softness[~hard] ** 2)
    at_low, at_high = np.abs(values - c.low) < 1e-8, np.abs(values - c.high) < 1e-8
    active = np.flatnonzero(hard & (at_low | at_high))
    u, *_ = np.linalg.lstsq(a[active].T, force, rcond=None)
    assert np.abs(a[active].T @ u - force).max() < 1e-7  # nothing but active constraints holds x from x0
    one_sided = at_low[active] != at_high[active]
    assert (u[one_sided] * np.where(at_low[active], 1, -1)[one_sided] > -1e-8).all()


def test_without_effect_it_is_the_same_array():
    _, x0, variance = problem()
    assert constrain(x0, variance, Constraints.none(3)) is x0
    slack = hold(range(40), np.ones(3), low=-1e3, high=1e3)
    assert np.array_equal(constrain(x0, variance, slack), x0)
    single = x0.astype(np.float32)
    assert constrain(single, variance, hold([4], np.ones(3), value=0.0)).dtype == np.float32


def test_far_constraints_do_not_disturb_one_another():
    """A long utterance, in linear time: near each constraint the result is that of its surroundings alone."""
    rng, x0, variance = problem(4000, 2, 1)
    vector = rng.normal(size=2)
    x = constrain(x0, variance, hold([500, 501, 3500], vector, value=2.0))
    alone = constrain(x0[300:700], variance[300:700], hold([200, 201], vector, value=2.0))
    assert np.abs(x[400:600] - alone[100:300]).max() < 1e-9
    assert np.abs(x[1500:2500] - x0[1500:2500]).max() < 1e-12


def test_slow_influence_is_followed_as_far_as_it_reaches():
    """Nearly no static information: a key moves hundreds of frames, and the dense solve agrees."""
    frames = 400
    variance = np.array([[1e4], [1.0], [1.0]])
    x0 = np.zeros((frames, 1))
    c = hold([100, 101, 300], np.ones(1), low=1.0)
    x = constrain(x0, variance, c)
    a = c.matrix(frames, STATIC_DELTA_DELTA2).toarray()
    spread = np.linalg.inv(dense_normal_matrix(np.broadcast_to(variance, (frames, 3, 1)), STATIC_DELTA_DELTA2))
    gram = a @ spread @ a.T
    u = np.linalg.solve(gram, np.ones(3))
    if (u < 0).any():  # at the optimum no multiplier pulls
        kept = u > 0
        u = np.where(kept, 0.0, 0.0)
        u[kept] = np.linalg.solve(gram[np.ix_(kept, kept)], np.ones(kept.sum()))
    assert np.abs(x[:, 0] - spread @ a.T @ u).max() < 1e-9 and np.abs(x[200]) > 0.1


def test_doubled_constraints_agree_and_contradictions_are_named():
    _, x0, variance = problem()
    once = hold([7], np.ones(3), value=1.0, label="key at 7")
    twice = Constraints.joined([once, hold([7], 2 * np.ones(3), value=2.0, label="the same")])
    assert np.abs(constrain(x0, variance, twice) - constrain(x0, variance, once)).max() < 1e-7
    against = Constraints.joined([once, hold([7], np.ones(3), value=1.5, label="another key")])
    with pytest.raises(DnnvssError, match=r"contradict.*key.*frame 7.*beside.*key"):
        constrain(x0, variance, against)
    ranges = Constraints.joined([hold([7], np.ones(3), low=1.0), hold([7], np.ones(3), high=0.5)])
    with pytest.raises(DnnvssError, match="contradict"):
        constrain(x0, variance, ranges)
    soft = Constraints.joined([once, hold([7], np.ones(3), value=1.5, softness=0.1)])
    assert violations(once, constrain(x0, variance, soft)).max() < 1e-9


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"low": 2.0, "high": 1.0}, "range that is empty"),
        ({"value": np.nan}, "not a number"),
        ({"value": np.inf}, "range that is empty"),
        ({"value": 0.0, "softness": -1.0}, "softness"),
    ],
)
def test_bad_constraints_are_named(changes, match):
    with pytest.raises(DnnvssError, match=f"'lips' at frame 3.*{match}"):
        hold([3], np.ones(2), label="lips", **changes)


def test_constraints_that_do_not_fit_are_refused():
    _, x0, variance = problem()
    with pytest.raises(DnnvssError, match="frame 40, and the trajectory has 40 frames"):
        constrain(x0, variance, hold([40], np.ones(3), value=0.0))
    with pytest.raises(DnnvssError, match="2 parameters do not fit"):
        constrain(x0, variance, hold([4], np.ones(2), value=0.0))
    with pytest.raises(DnnvssError, match="measures nothing"):
        hold([4], np.zeros(3), value=0.0)
