"""Canonical correlation against a case on paper, the generalised eigenvalue problem, scikit-learn and least squares."""

import numpy as np
import pytest
from scipy.linalg import eigh

from dnnvss.systems.canonical import Moments, canonical, correlations, inverse_root, regression


def data(rows: int = 400, r: int = 5, s: int = 3) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    x = rng.normal(size=(rows, r)) @ rng.normal(size=(r, r)) + 5
    y = x[:, :2] @ rng.normal(size=(2, s)) + 2 * rng.normal(size=(rows, s)) - 7
    return x, y


def covariance(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.cov(np.hstack([x, y]).T, bias=True)


def test_two_variables_on_paper() -> None:
    # x1, x2 uncorrelated of variance 4 and 1; y = x1 + x2 + noise of variance 4: variance 9, covariances 4 and 1.
    # R2 = c' Cxx^-1 c / 9 = (16 / 4 + 1) / 9 = 5 / 9; the factor points along Cxx^-1 c = (1, 1); its variance is 5.
    found = canonical(np.array([[4.0, 0, 4], [0, 1, 1], [4, 1, 9]]), 2)
    assert found.correlations == pytest.approx([np.sqrt(5 / 9)])
    np.testing.assert_allclose(np.abs(found.x[:, 0]), np.array([1, 1]) / np.sqrt(5))
    np.testing.assert_allclose(np.abs(found.y), [[1 / 3]])
    np.testing.assert_allclose(regression(np.array([[4.0, 0, 4], [0, 1, 1], [4, 1, 9]]), 2), [[1, 1]])


def test_it_solves_the_generalised_eigenvalue_problem() -> None:
    x, y = data()
    c = covariance(x, y)
    cross, zero = c[:5, 5:], np.zeros
    left = np.block([[zero((5, 5)), cross], [cross.T, zero((3, 3))]])
    right = np.block([[c[:5, :5], zero((5, 3))], [zero((3, 5)), c[5:, 5:]]])
    values, vectors = eigh(left, right)
    found = canonical(c, 5)
    np.testing.assert_allclose(found.correlations, values[::-1][:3], atol=1e-10)
    top = vectors[:5, -1] / np.linalg.norm(vectors[:5, -1])
    assert abs(top @ found.x[:, 0] / np.linalg.norm(found.x[:, 0])) == pytest.approx(1, abs=1e-8)


def test_it_agrees_with_scikit_learn() -> None:
    from sklearn.cross_decomposition import CCA

    x, y = data()
    ours = canonical(covariance(x, y), 5)
    u, v = CCA(3, max_iter=5000, tol=1e-12).fit(x, y).transform(x, y)
    theirs = [np.corrcoef(a, b)[0, 1] for a, b in zip(u.T, v.T, strict=True)]
    np.testing.assert_allclose(ours.correlations, theirs, atol=1e-6)
    projected = np.corrcoef((x @ ours.x).T, u.T)[:3, 3:]
    np.testing.assert_allclose(np.abs(np.diag(projected)), 1, atol=1e-5)


def test_factors_are_uncorrelated_but_in_pairs() -> None:
    x, y = data()
    found = canonical(covariance(x, y), 5)
    both = np.corrcoef(np.hstack([x @ found.x, y @ found.y]).T)
    expected = np.eye(6)
    expected[:3, 3:] = expected[3:, :3] = np.diag(found.correlations)
    np.testing.assert_allclose(both, expected, atol=1e-10)


def test_with_all_factors_it_is_least_squares_and_with_fewer_of_lower_rank() -> None:
    x, y = data()
    c = covariance(x, y)
    exact, *_ = np.linalg.lstsq(x - x.mean(0), y - y.mean(0), rcond=None)
    np.testing.assert_allclose(regression(c, 5), exact.T, atol=1e-10)
    assert np.linalg.matrix_rank(regression(c, 5, factors=1)) == 1
    apart = np.vstack([regression(c[:6, :6], 5), regression(np.delete(np.delete(c, 5, 0), 5, 1), 5)])
    np.testing.assert_allclose(apart, exact.T, atol=1e-10)


def test_columns_that_say_the_same_twice_change_nothing() -> None:
    x, y = data()
    twice = np.hstack([x, x[:, :1] - 2 * x[:, 1:2], np.ones((len(x), 1))])
    c, same = covariance(x, y), covariance(twice, y)
    np.testing.assert_allclose(canonical(same, 7).correlations[:3], canonical(c, 5).correlations, atol=1e-9)
    centred = x - x.mean(0), twice - twice.mean(0)
    np.testing.assert_allclose(centred[1] @ regression(same, 7).T, centred[0] @ regression(c, 5).T, atol=1e-8)


def test_a_ridge_shrinks_and_is_off_by_default() -> None:
    x, y = data()
    c = covariance(x, y)
    assert (canonical(c, 5, ridge=0.5).correlations < canonical(c, 5).correlations).all()
    np.testing.assert_array_equal(regression(c, 5), regression(c, 5, ridge=0.0))


def test_many_at_once_are_each_by_itself() -> None:
    x, y = data()
    many = np.stack([covariance(x[:n], y[:n]) for n in (4, 50, 400)])
    each = [canonical(c, 5).correlations for c in many]
    np.testing.assert_allclose(correlations(many, 5), each, atol=1e-9)
    assert each[0][0] == pytest.approx(1)  # four rows, five variables: all fits


def test_moments_in_chunks_are_those_of_the_whole() -> None:
    rows = np.random.default_rng(0).normal(1000, 1, (100, 4)).astype(np.float32)
    found = Moments.of([rows[:0], rows[:30], rows[30:31], rows[31:]])
    np.testing.assert_allclose(found.mean, rows.mean(0, dtype=np.float64))
    np.testing.assert_allclose(found.covariance, np.cov(rows.T.astype(float), bias=True), atol=1e-9)
    assert found.count == 100


def test_inverse_root_of_a_matrix_without_full_rank() -> None:
    root = inverse_root(np.diag([4.0, 0, 1]))
    np.testing.assert_allclose(root, np.diag([0.5, 0, 1]))
