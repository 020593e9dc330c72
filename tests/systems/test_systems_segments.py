"""Segments by a guide: a recorded sentence comes back, joins count by their weight, fades add up to one."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from conftest import CLOCK, TABLE

from dnnvss.errors import DnnvssError
from dnnvss.systems import Example, Prediction
from dnnvss.systems.segments import GuidedSegments, SegmentSettings


@pytest.fixture(scope="module")
def model(examples: dict[str, list[Example]], tmp_path_factory: pytest.TempPathFactory) -> GuidedSegments:
    fitted = GuidedSegments(TABLE, CLOCK, SegmentSettings(length=0.1, every=0.01))
    fitted.fit(examples["train"], examples["val"], tmp_path_factory.mktemp("segments"))
    return fitted


def test_a_guide_that_was_recorded_comes_back(model: GuidedSegments, examples: dict[str, list[Example]],
                                              monkeypatch: pytest.MonkeyPatch) -> None:
    example = examples["train"][1]
    monkeypatch.setattr(model, "stretch_", np.ones(1))
    monkeypatch.setattr(model.leader, "predict", lambda e: Prediction(example.targets, np.ones(1)))
    inner = slice(model.half, len(example.targets) - 2 * model.half)
    found = model.predict(example).mean[:, 0]
    np.testing.assert_allclose(found[inner], example.targets[inner, 0], atol=1e-5)
    assert found.shape == example.targets[:, 0].shape


def test_the_path_is_the_cheapest_of_all(model: GuidedSegments, examples: dict[str, list[Example]],
                                         monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(model, "settings", SegmentSettings(length=0.1, every=0.01, candidates=3, join=2.0))
    guide = examples["test"][0].targets[: 3 * model.half, 0]
    rows = model.nearest(np.stack(model._pieces(guide))[:, model._places])
    worth = {}
    for path in np.ndindex(*(len(entries) for entries, _ in rows)):
        starts = [entries[k] for (entries, _), k in zip(rows, path, strict=True)]
        cost = sum(costs[k] for (_, costs), k in zip(rows, path, strict=True))
        for a, b in pairwise(starts):
            gap = model.static_[a + model.half : a + 2 * model.half] - model.static_[b : b + model.half]
            cost += 2.0 * (gap.astype(float) ** 2).sum() / model.half
        worth[tuple(int(s) for s in starts)] = cost
    assert tuple(model.chosen(guide)) == min(worth, key=worth.get)


def test_fades_add_up_to_one(model: GuidedSegments, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(model, "static_", np.ones((50, 3), np.float32))
    np.testing.assert_allclose(model.faded([0, 7, 3, 11], 2 * model.half), 1)


def test_segments_lie_in_frames_that_were_measured(model: GuidedSegments) -> None:
    valid = np.ones(30, bool)
    valid[14] = False
    assert model._starts(valid).tolist() == [0, 1, 2, 3, 4, *range(15, 21)]
    assert not len(model._starts(valid[:5]))


def test_mistakes_are_told(examples: dict[str, list[Example]], tmp_path: Path) -> None:
    with pytest.raises(DnnvssError, match=r"model\.guide\.contxt is no setting"):
        SegmentSettings(guide={"system": "cca", "contxt": 1})
    long = GuidedSegments(TABLE, CLOCK, SegmentSettings(length=100.0))
    with pytest.raises(DnnvssError, match="no 100 s of the training were measured in one piece"):
        long.fit(examples["train"], examples["val"], tmp_path)
