"""Long trajectories in passages are those of the whole, to rounding."""

import numpy as np
import pytest

from dnnvss.curves import Constraints, constrain, hold, mlpg, passages, resample
from dnnvss.curves.passages import cut, in_passages, rewritten
from dnnvss.curves.windows import STATIC_DELTA_DELTA2
from dnnvss.errors import DnnvssError
from dnnvss.timing import FrameClock

FRAMES, COLUMNS = 1500, 3


def prediction() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    statics = np.cumsum(rng.normal(size=(FRAMES, COLUMNS)), axis=0) * 0.1
    deltas = np.gradient(statics, axis=0)
    mean = np.stack([statics, deltas, np.gradient(deltas, axis=0)], axis=1)
    return mean, rng.uniform(0.5, 2, mean.shape) * np.array([1, 0.01, 0.001])[:, None]


def keys() -> Constraints:
    rng = np.random.default_rng(1)
    return hold(np.sort(rng.choice(FRAMES, 150, replace=False)), rng.normal(size=COLUMNS), low=-0.5, high=0.5)


def test_passages_make_the_trajectory_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    mean, variance = prediction()
    whole, held = mlpg(mean, variance), keys()
    wanted = constrain(whole, variance, held)
    for name, value in (("LONG", 400), ("_PASSAGE", 350), ("_MARGIN", 300)):
        monkeypatch.setattr(passages, name, value)
    seen: list[slice] = []

    def made(around: slice) -> np.ndarray:
        seen.append(around)
        return np.asarray(mlpg(mean[around], cut(variance, FRAMES, around)))

    np.testing.assert_allclose(in_passages(FRAMES, made), whole, atol=1e-9)
    assert [(s.start, s.stop) for s in seen] == [(0, 650), (50, 1000), (400, 1350), (750, 1500), (1100, 1500)]
    found = in_passages(FRAMES, lambda around: constrain(whole[around], variance[around], held.within(around)))
    np.testing.assert_allclose(found, wanted, atol=1e-9)


def test_rows_are_rewritten_from_what_they_were(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("LONG", 400), ("_PASSAGE", 350), ("_MARGIN", 30)):
        monkeypatch.setattr(passages, name, value)
    rows = np.random.default_rng(0).normal(size=(FRAMES, 2))
    given, kernel = rows.copy(), np.ones(21)

    def smoothed(around: slice, own: np.ndarray) -> np.ndarray:
        np.testing.assert_array_equal(own, rows[around])
        return np.stack([np.convolve(column, kernel, "same") for column in own.T], axis=1)

    found = rewritten(given, smoothed)
    np.testing.assert_allclose(found, smoothed(slice(0, FRAMES), rows), atol=1e-12)
    assert found is given


def test_what_is_short_is_made_at_once() -> None:
    seen: list[slice] = []
    in_passages(FRAMES, lambda around: seen.append(around) or np.zeros(FRAMES))  # type: ignore[func-returns-value]
    assert seen == [slice(0, FRAMES)]


def test_variances_that_all_frames_share_are_not_cut() -> None:
    shared = np.ones((3, COLUMNS))
    assert cut(shared, FRAMES, slice(2, 5)) is shared and cut(1.0, FRAMES, slice(2, 5)) == 1.0


def test_constraints_of_a_passage_are_counted_from_its_start() -> None:
    own = keys().within(slice(700, 900))
    assert len(own) and (own.frames >= 0).all() and (own.frames < 200).all()
    with pytest.raises(DnnvssError, match="of frame"):
        keys().check(100, STATIC_DELTA_DELTA2)



@pytest.mark.parametrize("rates", [(100, 25), (25, 100), ("29.97", 24)])
def test_another_rate_in_passages_is_that_of_the_whole(rates: tuple[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    source, target = (FrameClock(rate) for rate in rates)
    trajectory = prediction()[0][:, 0]
    whole = resample(trajectory, source, target)
    for name, value in (("LONG", 400), ("_PASSAGE", 350), ("_MARGIN", 60)):
        monkeypatch.setattr(passages, name, value)
    np.testing.assert_allclose(resample(trajectory, source, target), whole, atol=1e-12)
