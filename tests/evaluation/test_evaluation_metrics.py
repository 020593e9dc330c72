"""Each metric by hand, and its invariants."""

import numpy as np
import pytest

from dnnvss import DnnvssError
from dnnvss.evaluation import centred_rmse, correlation, global_variance_ratio, rmse

R = np.array([[1.0], [2.0], [3.0], [6.0]])  # mean 3, deviations -2 -1 0 3, sum of squares 14
P = np.array([[2.0], [2.0], [4.0], [4.0]])  # mean 3, deviations -1 -1 1 1, sum of squares 4


def test_correlation_by_hand():
    # products 2 + 1 + 0 + 3 = 6; 6 / sqrt(14 * 4)
    assert correlation(R, P) == pytest.approx(6 / np.sqrt(56))
    assert correlation(R, -3 * R + 7) == pytest.approx(-1)


def test_rmse_by_hand():
    # errors 1 0 1 -2: mean square 6 / 4
    assert rmse(R, P) == pytest.approx(np.sqrt(1.5))


def test_centred_rmse_by_hand():
    assert centred_rmse(R, P + 10) == pytest.approx(np.sqrt(1.5))  # both means are 3, and a constant does not count
    assert rmse(R, P + 10) ** 2 == pytest.approx(centred_rmse(R, P + 10) ** 2 + 10**2)


def test_global_variance_ratio_by_hand():
    assert global_variance_ratio(R, P) == pytest.approx(4 / 14)
    assert global_variance_ratio(R, 2 * R - 5) == pytest.approx(4)


def test_each_coefficient_on_its_own():
    both = correlation(np.hstack([R, P]), np.hstack([P, P]))
    assert both == pytest.approx([6 / np.sqrt(56), 1.0])


def test_what_cannot_be_measured():
    flat = np.full((4, 1), 0.1)
    assert correlation(R, flat).tolist() == [0.0]
    assert correlation(R, 1e-4 * R).tolist() == [0.0] and correlation(R, 0.01 * R) == pytest.approx(1)
    assert np.isnan(correlation(flat, R)).all() and np.isnan(correlation(flat, flat)).all()
    assert np.isnan(global_variance_ratio(flat, R)).all()
    assert global_variance_ratio(R, flat) == pytest.approx(0, abs=1e-30)
    assert rmse(flat, flat).tolist() == [0.0]
    one = R[:1]
    assert np.isnan(correlation(one, one)).all() and rmse(one, one + 2).tolist() == [2.0]
    for metric in (correlation, rmse, centred_rmse, global_variance_ratio):
        assert np.isnan(metric(R[:0], P[:0])).all()


def test_what_is_refused():
    with pytest.raises(DnnvssError, match=r"\(4, 1\) and prediction \(3, 1\)"):
        rmse(R, P[:3])
    with pytest.raises(DnnvssError, match="prediction holds values that are not finite"):
        correlation(R, P * np.nan)
