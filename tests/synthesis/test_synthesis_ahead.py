"""A face that moves ahead of its sound, or behind it."""

from types import SimpleNamespace

import numpy as np

from dnnvss.synthesis.plan import Plan
from dnnvss.synthesis.request import SpeakRequest
from dnnvss.synthesis.rig import RigRequest, spoken_take
from dnnvss.synthesis.speak import Spoken, ahead
from dnnvss.timing import Alignment, FrameClock, Tier


def test_frames_are_moved_and_the_ends_held() -> None:
    trajectory = np.arange(6.0)[:, None]
    assert ahead(trajectory, FrameClock(100), 0.02)[:, 0].tolist() == [2, 3, 4, 5, 5, 5]
    assert ahead(trajectory, FrameClock(100), -0.01)[:, 0].tolist() == [0, 0, 1, 2, 3, 4]
    assert ahead(trajectory, FrameClock(50), 0.0) is trajectory
    assert ahead(trajectory, FrameClock(50), 0.0).tolist() == trajectory.tolist()


def test_visemes_are_as_far_ahead_as_the_face() -> None:
    phones = Tier("phones", [(0, 0.3, "sil"), (0.3, 0.5, "AA"), (0.5, 1, "sil")])
    run = SimpleNamespace(task=SimpleNamespace(clock=FrameClock(100)))

    def opened(anticipation: float) -> float:
        spoken = Spoken(run, SpeakRequest(anticipation=anticipation), Plan("ah", Alignment([phones])),  # type: ignore
                        None, {}, np.zeros((100, 2)), (), {})  # type: ignore[arg-type]
        take = spoken_take(spoken, RigRequest("oculus", FrameClock(100))).take
        return float(np.flatnonzero(take.curves["aa"] > 0.5)[0])

    assert [opened(seconds) for seconds in (0.0, 0.1, -0.1)] == [30, 20, 40]
