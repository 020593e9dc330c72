"""Ratios, bootstrap intervals and paired tests."""

import numpy as np
import pytest
from scipy import stats

from dnnvss.evaluation.statistics import difference, differences, enough, estimate, holm, pooled


def mean_pairs(values):
    return np.column_stack([values, np.ones(len(values))])


def test_a_recall_pools_counts():
    assert pooled(np.array([[1.0, 2.0], [3.0, 3.0], [0.0, 0.0]])) == pytest.approx(4 / 5)
    assert np.isnan(pooled(np.zeros((3, 2))))


def test_the_interval_of_a_mean_is_that_of_the_normal_law():
    values = np.random.default_rng(0).normal(5, 2, size=400)
    e = estimate(mean_pairs(values), resamples=4000)
    half = 1.96 * values.std() / 20
    assert e.value == pytest.approx(values.mean())
    assert (e.low, e.high) == pytest.approx((values.mean() - half, values.mean() + half), abs=0.03)
    assert estimate(mean_pairs(values), seed=1) == estimate(mean_pairs(values), seed=1)


def test_intervals_cover_the_truth_as_often_as_they_say():
    rng = np.random.default_rng(0)
    inside = 0
    for i in range(200):
        e = estimate(mean_pairs(rng.normal(size=60)), seed=i, resamples=400)
        inside += e.low <= 0 <= e.high
    assert 0.90 <= inside / 200 <= 0.98


def test_the_permutation_test_agrees_with_the_t_test():
    rng = np.random.default_rng(3)
    first = rng.normal(size=50)
    second = first + rng.normal(0.12, 0.4, size=50)
    d = difference(mean_pairs(first), mean_pairs(second), resamples=20000)
    assert d.value == pytest.approx((second - first).mean())
    assert d.p == pytest.approx(stats.ttest_rel(second, first).pvalue, abs=0.01)
    assert d.low < d.value < d.high


def test_without_difference_p_is_one_and_with_a_clear_one_it_is_small():
    values = np.random.default_rng(0).normal(size=30)
    same = difference(mean_pairs(values), mean_pairs(values))
    assert same.value == 0 and same.p == 1.0
    clear = difference(mean_pairs(values), mean_pairs(values + 1))
    assert clear.p == pytest.approx(1 / 2001) and clear.low == pytest.approx(1)


def test_p_values_are_uniform_under_the_null():
    rng = np.random.default_rng(1)
    p = [difference(mean_pairs(rng.normal(size=25)), mean_pairs(rng.normal(size=25)), i, 300).p for i in range(200)]
    assert stats.kstest(p, "uniform").pvalue > 0.01


def test_many_differences_in_one_pass_are_those_one_by_one():
    rng = np.random.default_rng(2)
    systems = [np.column_stack([rng.normal(size=12), rng.integers(0, 3, 12)]).astype(float) for _ in range(4)]
    asked = [(0, 1), (2, 1), (3, 0)]
    for (a, b), found in zip(asked, differences(systems, asked, seed=5), strict=True):
        one = difference(systems[a], systems[b], seed=5)
        assert (found.value, found.low, found.high) == pytest.approx((one.value, one.low, one.high))
        assert found.p == one.p


def test_among_hundreds_of_tests_a_clear_difference_stays_clear_after_correction():
    rng = np.random.default_rng(0)
    values = rng.normal(size=50)
    systems = [mean_pairs(values + k + rng.uniform(-0.3, 0.3, 50)) for k in range(24)]
    asked = [(a, b) for a in range(24) for b in range(a)]
    found = differences(systems, asked, permutations=enough(len(asked)))
    assert max(holm([d.p for d in found])) < 0.01  # with 2,000 permutations it could not fall below .13
    assert enough(3) == 2000 and enough(276) == 55200


def test_sentences_that_one_system_lacks_are_left_out():
    first = np.array([[1.0, 1.0], [2.0, 1.0], [0.0, 0.0]])
    second = np.array([[2.0, 1.0], [3.0, 1.0], [9.0, 1.0]])
    assert difference(first, second).value == pytest.approx(1.0)
    assert np.isnan(difference(first[2:], second[2:]).p)


def test_holm_by_hand():
    # sorted .01 .02 .04: times 3, 2, 1 -> .03, .04, .04 (never less than the one before)
    assert holm([0.04, 0.01, float("nan"), 0.02])[:2] == pytest.approx([0.04, 0.03])
    assert holm([0.04, 0.01, float("nan"), 0.02])[3] == pytest.approx(0.04)
    assert np.isnan(holm([float("nan")])[0]) and holm([0.7, 0.9]) == pytest.approx([1.0, 1.0])


def test_one_sentence_has_a_value_and_no_interval():
    one = np.array([[3.0, 2.0], [0.0, 0.0]])
    found = estimate(one)
    assert found.value == 1.5 and np.isnan([found.low, found.high]).all()
    apart = difference(one, 2 * one * [1, 0.5])
    assert (apart.value, apart.p) == (1.5, 1.0) and np.isnan([apart.low, apart.high]).all()
