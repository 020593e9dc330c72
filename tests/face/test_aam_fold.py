"""Shapes that would fold are drawn back to where they do not, and no further."""

import numpy as np
import pytest
from face.aam_cases import CONFIG, GROUPS, clips

from dnnvss.face.aam import ActiveAppearanceModel, fit_aam
from dnnvss.face.aam.fold import FoldGuard
from dnnvss.face.aam.mesh import signed_areas
from dnnvss.face.lips import lip_pairs

SQUARE = np.array([[0.0, 0], [10, 0], [10, 10], [0, 10], [4, 5], [5, 4], [6, 5], [5, 6]])
"""A square of skin round a mouth of four points: left, upper, right, lower."""
TRIANGLES = np.array([[0, 1, 5], [1, 6, 5], [1, 2, 6], [2, 7, 6], [2, 3, 7], [3, 4, 7], [3, 0, 4], [0, 5, 4],
                      [4, 5, 7], [5, 6, 7]])
GUARD = FoldGuard(SQUARE, TRIANGLES, np.array([4, 5, 6, 7]))


def moved(point: int, x: float, y: float) -> np.ndarray:
    shape = SQUARE.copy()
    shape[point] += x, y
    return shape


def test_the_mean_turns_one_way_and_what_does_not_fold_is_left() -> None:
    assert (signed_areas(SQUARE[None], TRIANGLES) > 0).all()
    shape = moved(6, 2.0, 1.0)
    assert (GUARD.settled(shape) == shape).all()


def test_a_corner_that_leaves_the_face_is_drawn_back_to_its_rim() -> None:
    shape = GUARD.settled(moved(6, 8.0, 0.0))  # it may go to x = 10 less the share that triangle (1, 2, 6) keeps
    assert shape[6, 0] == pytest.approx(10 - 0.05 * 4, abs=0.01)
    assert (GUARD.settled(moved(6, 9.0, 0.0))[6] == pytest.approx(shape[6], abs=0.01))


def test_it_is_continuous_over_time() -> None:
    way = np.stack([moved(6, x, 0.5 * x) for x in np.linspace(0, 12, 400)])
    steps = np.abs(np.diff(GUARD.settled(way), axis=0)).max(axis=(1, 2))
    assert steps.max() < 3 * steps[0]


def test_crossing_lips_meet_half_way() -> None:
    shape = SQUARE.copy()
    shape[5, 1], shape[7, 1] = 6.0, 5.0
    assert GUARD.settled(shape)[[5, 7], 1] == pytest.approx([5.5, 5.5])


def test_the_corners_of_a_face_never_fold() -> None:
    model: ActiveAppearanceModel = fit_aam(clips(), GROUPS, CONFIG, progress=False)
    rng = np.random.default_rng(3)
    parameters = rng.choice([-6.0, 6.0], (300, model.size)) * model.deviations
    raw, shown = model.points(parameters), model.drawn(parameters, np.zeros_like(model.mean_shape))
    assert model.guard.folded(raw).any() and not model.guard.folded(shown).any()
    upper, lower = lip_pairs(model.mean_shape, model.layout.inner)[0].T
    assert (shown[:, lower, 1] >= shown[:, upper, 1] - 1e-9).all()
