"""What is taken for a face that a tracker lost."""

import numpy as np

from data_prep.checks import _ghosts, _rescaled
from dnnvss.corpus import checkup


def clips() -> dict[str, np.ndarray]:
    """Three clips of ten steady points, the last four round the eyes."""
    rng = np.random.default_rng(0)
    face = rng.uniform(50, 150, (10, 2))
    return {f"c{k}": (face + rng.normal(0, 0.3, (40, 10, 2))).astype(np.float32) for k in range(3)}


def test_a_lid_that_falls_is_no_ghost_and_a_point_that_leaves_is() -> None:
    points = clips()
    points["c1"][20:23, 6:] += (0, 12)
    points["c2"][10, :6] += (0, 12)
    valid = {name: np.ones(40, bool) for name in points}
    blind = _ghosts(points, valid, checkup.LIMITS, [])
    assert blind["c1"][20:23].all()
    found = _ghosts(points, valid, checkup.LIMITS, [6, 7, 8, 9])
    assert not found["c0"].any() and not found["c1"].any() and found["c2"][10]


def test_points_in_another_scale_are_told_from_a_face_farther_off() -> None:
    marks = {name: {"points": points, "valid": np.ones(40, bool)} for name, points in clips().items()}
    assert _rescaled(marks) == {}
    own = marks["c1"]["points"]
    marks["c1"]["points"] = own / 2
    assert {name: round(times, 1) for name, times in _rescaled(marks).items()} == {"c1": 0.5}
    marks["c1"]["points"] = own.mean(axis=(0, 1)) + (own - own.mean(axis=(0, 1))) / 2
    assert _rescaled(marks) == {}
