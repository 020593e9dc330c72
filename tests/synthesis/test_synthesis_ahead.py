"""A face that moves ahead of its sound, or behind it."""

import numpy as np

from dnnvss.synthesis.speak import ahead
from dnnvss.timing import FrameClock


def test_frames_are_moved_and_the_ends_held() -> None:
    trajectory = np.arange(6.0)[:, None]
    assert ahead(trajectory, FrameClock(100), 0.02)[:, 0].tolist() == [2, 3, 4, 5, 5, 5]
    assert ahead(trajectory, FrameClock(100), -0.01)[:, 0].tolist() == [0, 0, 1, 2, 3, 4]
    assert ahead(trajectory, FrameClock(50), 0.0) is trajectory
    assert ahead(trajectory, FrameClock(50), 0.0).tolist() == trajectory.tolist()
