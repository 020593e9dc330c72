"""Cutting trajectories into gestures."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dnnvss.errors import DnnvssError
from dnnvss.timing import Alignment, FrameClock, Tier
from dnnvss.visemes import GestureSettings, cut, reference_speed, silence_mask

CLOCK = FrameClock(100)
KEYS = np.array([0.0, 0.2, 0.32, 0.55, 0.7, 1.0])
POSES = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 1], [-1, 1, 0], [0, 0, 0]])


def course(times: np.ndarray, keys: np.ndarray = KEYS, poses: np.ndarray = POSES) -> np.ndarray:
    """Minimum-jerk movements from pose to pose, which stand still at every key."""
    after = np.clip(np.searchsorted(keys, times, side="right"), 1, len(keys) - 1)
    s = np.clip((times - keys[after - 1]) / (keys[after] - keys[after - 1]), 0, 1)[:, None]
    return poses[after - 1] + (poses[after] - poses[after - 1]) * s**3 * (10 - 15 * s + 6 * s**2)


def gestures_of(trajectory: np.ndarray, silence: np.ndarray | None = None, clock: FrameClock = CLOCK,
                **settings: object) -> tuple[np.ndarray, np.ndarray]:
    chosen = GestureSettings(**settings)
    quiet = np.zeros(len(trajectory), bool) if silence is None else silence
    reference = reference_speed([trajectory], [np.zeros_like(quiet)], clock, chosen)
    found = cut(trajectory, quiet, clock, chosen, reference)
    return found.edges, found.rest


@pytest.mark.parametrize("rate", ["100", "60", "200"])
def test_speed_minima_are_the_turns(rate: str) -> None:
    clock = FrameClock(rate)
    edges, rest = gestures_of(course(clock.centres(clock.edge(1.0))), clock=clock)
    np.testing.assert_allclose(clock.times(edges), KEYS, atol=0.011)  # towards the slower of two movements
    assert not rest.any()


def test_turns_survive_noise() -> None:
    noise = np.random.default_rng(0).normal(0, 0.002, (100, 3))
    edges, _ = gestures_of(course(CLOCK.centres(100)) + noise, smoothing=0.02)
    np.testing.assert_allclose(edges / 100, KEYS, atol=0.02)


def test_acceleration_of_one_coefficient_changes_sign_in_mid_movement() -> None:
    poses = np.array([[0.0], [1], [0], [1], [0.5], [0]])
    edges, _ = gestures_of(course(CLOCK.centres(100), poses=poses), rule="acceleration", coefficients=1)
    middles = (KEYS[:-1] + KEYS[1:]) / 2
    between = [0.7]  # 1 to 0.5 to 0 goes one way: the stop between is an inflection, too
    np.testing.assert_allclose(edges[1:-1] / 100, np.sort([*middles, *between]), atol=0.011)


def test_acceleration_along_the_path_changes_sign_at_turns_and_between() -> None:
    edges, _ = gestures_of(course(CLOCK.centres(100)), rule="acceleration", smoothing=0.005, shortest=0.02)
    expected = np.sort([*KEYS[1:-1], *(KEYS[:-1] + KEYS[1:]) / 2])
    np.testing.assert_allclose(edges[1:-1] / 100, expected, atol=0.011)


def test_rest_is_found_in_silence_only() -> None:
    keys, poses = np.array([0.3, 0.5, 0.7, 1.0, 1.2]), np.array([[0.0, 0], [1, 0], [1, 1], [1, 1], [0, 0]])
    movement = course(CLOCK.centres(150), keys, poses)  # at rest until 0.3 s, held 0.7 to 1.0, at rest after 1.2
    silence = np.zeros(150, bool)
    silence[:30] = silence[110:] = True
    edges, rest = gestures_of(movement, silence)
    assert rest.tolist() == [True, *[False] * (len(rest) - 2), True]
    np.testing.assert_allclose([edges[1], edges[-2]], [30, 120], atol=3)
    _, everywhere = gestures_of(movement, np.ones(150, bool))
    assert everywhere.sum() == 3  # without an alignment the hold is a rest, too


def test_the_frame_after_a_rest_is_no_rest() -> None:
    walk = np.cumsum(np.random.default_rng(0).normal(0, 1, (20, 1)), axis=0)
    movement, silence = np.concatenate([np.zeros((10, 1)), walk]), np.arange(30) < 10
    settings = GestureSettings(rule="acceleration", shortest=0.0, prominence=0.0, smoothing=0.0)
    found = cut(movement, silence, FrameClock(25), settings, 10.0)
    np.testing.assert_allclose(found.edges[:3], [0, 9, 10.2], atol=0.01)
    assert found.rest.tolist() == [True, *[False] * (len(found) - 1)]


def test_a_short_stillness_is_no_rest() -> None:
    keys, poses = np.array([0.0, 0.3, 0.36, 0.66]), np.array([[0.0], [1], [1], [0]])
    silence = np.ones(66, bool)
    _, rest = gestures_of(course(CLOCK.centres(66), keys, poses), silence, rest=0.1)
    assert not rest.any()
    _, rest = gestures_of(course(CLOCK.centres(66), keys, poses), silence, rest=0.1, rest_shortest=0.05)
    assert rest.tolist() == [False, True, False]


@given(st.integers(0, 2**31), st.integers(1, 120), st.sampled_from(["speed", "acceleration"]),
       st.sampled_from([0.0, 0.06, 0.2]), st.integers(0, 3))
def test_pieces_are_contiguous_and_long_enough(seed: int, frames: int, rule: str, shortest: float, k: int) -> None:
    random = np.random.default_rng(seed)
    trajectory = np.cumsum(random.normal(0, 1, (frames, 3)), axis=0)
    settings = GestureSettings(rule=rule, shortest=shortest, coefficients=k)
    found = cut(trajectory, random.random(frames) < 0.5, CLOCK, settings, 100.0)
    assert found.edges[0] == 0
    assert found.edges[-1] == frames
    assert (np.diff(found.edges) > 0).all()
    assert len(found) == len(found.rest) == len(found.edges) - 1
    if len(found) > 1:
        assert np.diff(found.edges).min() >= shortest * 100


def test_reference_speed_by_hand() -> None:
    ramp = np.arange(50)[:, None] * np.array([[0.03, 0.04]])  # 5 units a second
    silence = np.zeros(50, bool)
    silence[40:] = True
    still = np.zeros((20, 2))
    settings = GestureSettings(smoothing=0.0)
    assert reference_speed([ramp], [silence], CLOCK, settings) == pytest.approx(5)
    assert reference_speed([ramp, still], [silence, np.ones(20, bool)], CLOCK, settings) == pytest.approx(5)
    with pytest.raises(DnnvssError, match="no movement outside silence"):
        reference_speed([still], [np.zeros(20, bool)], CLOCK, settings)


def test_silence_mask() -> None:
    phones = Tier("phones", [(0, 0.02, "sil"), (0.02, 0.04, "AA"), (0.04, 0.05, "sp")])
    assert silence_mask(Alignment([phones]), CLOCK).tolist() == [True, True, False, False, True]


def test_refusals() -> None:
    with pytest.raises(DnnvssError, match="rule=jerk is unknown"):
        GestureSettings(rule="jerk")
    with pytest.raises(DnnvssError, match="shortest=-1 is too little"):
        GestureSettings(shortest=-1)
    with pytest.raises(DnnvssError, match=r"shape \(5, 2\) with silence \(4,\)"):
        cut(np.zeros((5, 2)), np.zeros(4, bool), CLOCK, GestureSettings(), 1.0)
    with pytest.raises(DnnvssError, match="Encode the video again"):
        cut(np.full((5, 2), np.nan), np.zeros(5, bool), CLOCK, GestureSettings(), 1.0)
