"""Clusters of gestures: distances, rare units, determinism."""

import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.visemes.clusters import METHODS, DtwMedoids, KMeans, partition


def slow_dtw(a: np.ndarray, b: np.ndarray) -> float:
    """The textbook recursion, one pair at a time."""
    table = np.full((len(a) + 1, len(b) + 1), np.inf)
    table[0, 0] = 0
    for i in range(1, len(a) + 1):
        for j in range(1, len(b) + 1):
            best = min(table[i - 1, j], table[i, j - 1], table[i - 1, j - 1])
            table[i, j] = ((a[i - 1] - b[j - 1]) ** 2).sum() + best
    return table[-1, -1] / len(a)


def test_dtw_equals_the_textbook() -> None:
    random = np.random.default_rng(0)
    gestures, centres = random.normal(size=(7, 6, 3)), random.normal(size=(4, 6, 3))
    expected = [[slow_dtw(g, c) for c in centres] for g in gestures]
    np.testing.assert_allclose(DtwMedoids().distances(gestures, centres), expected, rtol=1e-4)


def test_dtw_forgives_timing_and_euclid_does_not() -> None:
    early = np.array([0, 0, 1, 1, 1, 1.0])[None, :, None]
    late = np.array([0, 0, 0, 0, 1, 1.0])[None, :, None]
    assert DtwMedoids().distances(early, late)[0, 0] == 0
    assert KMeans().distances(early, late)[0, 0] == pytest.approx(2 / 6)


def test_euclidean_distance_by_hand() -> None:
    gestures, centres = np.arange(12.0).reshape(2, 3, 2), np.zeros((1, 3, 2))
    np.testing.assert_allclose(KMeans().distances(gestures, centres)[:, 0], (gestures**2).sum((1, 2)) / 3)
    np.testing.assert_allclose(KMeans().centre(gestures), gestures.mean(0))


def test_the_medoid_is_the_member_nearest_to_all() -> None:
    gestures = np.array([0.0, 1, 1.1, 2])[:, None, None] * np.ones((1, 4, 1))
    np.testing.assert_array_equal(DtwMedoids().centre(gestures), gestures[1])


def _blobs(counts: list[int], seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    middles = random.normal(0, 10, (len(counts), 5, 2))
    classes = np.repeat(np.arange(len(counts)), counts)
    return middles[classes] + random.normal(0, 0.3, (len(classes), 5, 2)), classes


@pytest.mark.parametrize("name", METHODS)
def test_separate_classes_are_recovered(name: str) -> None:
    gestures, classes = _blobs([30, 20, 40, 25])
    found = partition(gestures, 4, METHODS[name](), least=5)
    assert len(found.centres) == 4
    for unit in range(4):
        assert len(set(classes[found.members == unit])) == 1
    expected = METHODS[name]().distances(gestures, found.centres).min(1)
    assert found.spread == pytest.approx(expected.mean())


@pytest.mark.parametrize("name", METHODS)
def test_no_unit_is_rare(name: str) -> None:
    gestures, _ = _blobs([60, 50, 1, 2, 40, 1])  # four strays, each of which draws a centre to itself
    found = partition(gestures, 6, METHODS[name](), least=8)
    counts = np.bincount(found.members)
    assert counts.min() >= 8
    assert counts.sum() == len(gestures)
    assert len(counts) == 6  # wide units were split in place of the strays


def test_too_few_gestures_make_fewer_units() -> None:
    gestures, _ = _blobs([20, 20])
    assert len(partition(gestures, 30, KMeans(), least=10).centres) <= 4
    with pytest.raises(DnnvssError, match="40 gestures are too few for 3 units of 50 members"):
        partition(gestures, 3, KMeans(), least=50)


def test_identical_gestures() -> None:
    found = partition(np.ones((30, 4, 2)), 5, KMeans(), least=2)
    assert len(found.centres) == 1
    assert found.spread == 0


def test_the_same_seed_gives_the_same_units() -> None:
    gestures = np.random.default_rng(1).normal(size=(200, 4, 2))
    one, two = (partition(gestures, 12, KMeans(), least=5, seed=3) for _ in range(2))
    np.testing.assert_array_equal(one.members, two.members)
    assert (partition(gestures, 12, KMeans(), least=5, seed=4).members != one.members).any()
