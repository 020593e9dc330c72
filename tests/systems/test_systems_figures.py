"""What TensorBoard shows: curves, and the face where it is known."""

import numpy as np
from conftest import CLOCK, TABLE
from evaluation.test_evaluation_comparison import MOUTH

from dnnvss.systems import Example
from dnnvss.systems.ensemble import Ensemble, EnsembleSettings
from dnnvss.systems.figures import moments_of, trajectory_figure
from dnnvss.systems.phone_mean import PhoneMean


def test_the_moments_are_the_extremes_of_what_was_measured() -> None:
    track = np.array([5.0, 1, 2, 9, 3, 4])
    assert moments_of(track, np.array([True, True, True, False, True, True])) == [0, 1, 4]
    assert moments_of(track, np.zeros(6, bool)) == [0]


def test_faces_stand_beside_the_curves(examples: dict[str, list[Example]], tmp_path) -> None:
    model = PhoneMean(TABLE, CLOCK)
    model.fit(examples["train"], examples["val"], tmp_path)
    example = examples["val"][0]
    assert len(trajectory_figure(example, model.predict).axes) == 3
    figure = trajectory_figure(example, model.predict, MOUTH)
    assert len(figure.axes) == 3 + 6
    assert sum(axis.get_title().startswith("measured") for axis in figure.axes) == 3


def test_a_face_reaches_the_systems_inside() -> None:
    model = Ensemble(TABLE, CLOCK, EnsembleSettings({"phone_mean": {}, "kernel": {}}))
    model.shown_on(MOUTH)
    assert all(system.face is MOUTH for system in (model, *model.systems.values()))
