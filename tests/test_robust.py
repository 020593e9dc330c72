"""Robust spread: a normal sample by its standard deviation, a case on paper, and values far out."""

import numpy as np
import pytest

from dnnvss.robust import TO_SIGMA, deviation, robust_limit, spread


def test_on_paper():
    assert deviation(np.array([1.0, 2.0, 4.0, 8.0, 100.0])) == TO_SIGMA * 3
    assert spread(np.array([[-1.0, 2.0], [3.0, 0.0], [2.0, -8.0]])).tolist() == [TO_SIGMA * 2, TO_SIGMA * 2]
    assert robust_limit(np.array([1.0, 2.0, 4.0, 8.0, 100.0]), 2.0) == 4 + 2 * TO_SIGMA * 3
    assert robust_limit(np.ones(5), 2.0, least=7.0) == 7.0


def test_normal_data_gives_the_standard_deviation_with_a_tenth_of_it_far_out():
    values = np.random.default_rng(0).normal(3.0, 2.0, 100_000)
    assert deviation(values) == pytest.approx(2.0, rel=0.02)
    values[::10] += 1e6
    assert deviation(values) == pytest.approx(2.0, rel=0.2)
