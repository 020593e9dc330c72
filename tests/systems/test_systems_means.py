"""The null models count the frames that the codes have, wherever the alignment begins."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import CLOCK, TABLE

from dnnvss.curves import mlpg
from dnnvss.features import encode
from dnnvss.systems import Example, VisualModel
from dnnvss.systems.phone_mean import PhoneMean
from dnnvss.systems.training_mean import TrainingMean
from dnnvss.timing import Alignment


@pytest.mark.parametrize("kind", [TrainingMean, PhoneMean])
def test_an_alignment_that_begins_later_gives_the_same_frames(
        kind: type[VisualModel], examples: dict[str, list[Example]], tmp_path: Path) -> None:
    model = kind(TABLE, CLOCK)
    model.fit(examples["train"], examples["val"], tmp_path)
    example = examples["test"][0]
    moved = Alignment(tier.moved(2.0) for tier in example.alignment.tiers)
    late = replace(example, alignment=moved, codes=encode(moved, "word", TABLE, CLOCK))
    np.testing.assert_array_equal(model.predict(late).mean, model.predict(example).mean)
    assert len(model.predict(late).mean) == len(example.codes)


@pytest.mark.parametrize("kind", [TrainingMean, PhoneMean])
def test_means_and_variances_are_those_of_all_frames_together(
        kind: type[TrainingMean | PhoneMean], examples: dict[str, list[Example]], tmp_path: Path) -> None:
    train = [replace(e, valid=np.arange(len(e.codes)) % 7 != k % 7) for k, e in enumerate(examples["train"])]
    train[0] = replace(train[0], valid=np.zeros(len(train[0].codes), bool))  # of which nothing was measured
    model = kind(TABLE, CLOCK)
    model.fit(train, examples["val"], tmp_path)
    frames = np.concatenate([e.measured[0][e.measured[1]] for e in train]).astype(float)
    labels = np.concatenate([model.classes(e)[e.measured[1]] for e in train])
    least = np.maximum(1e-4 * frames.var(0), 1e-12)
    for k in range(len(model.mean_)):
        own = frames[labels == k]
        np.testing.assert_allclose(model.mean_[k], own.mean(0) if len(own) else frames.mean(0), rtol=1e-9, atol=1e-12)
        around = own.var(0) if len(own) > 1 else frames.var(0)
        np.testing.assert_allclose(model.variance_[k], np.maximum(around, least), rtol=1e-9)


def test_the_training_mean_stands_still_where_clips_begin_and_end_otherwise(
        examples: dict[str, list[Example]], tmp_path: Path) -> None:
    """Recordings cut at pauses have slopes on average, of which parameter generation would make a movement."""
    train = []
    for example in examples["train"]:
        targets = example.targets.copy()
        targets[:, 1] += 0.3 * targets[:, 0].std(axis=0)
        train.append(replace(example, targets=targets))
    model = TrainingMean(TABLE, CLOCK)
    model.fit(train, examples["val"], tmp_path)
    prediction = model.predict(examples["test"][0])
    assert np.ptp(mlpg(prediction.mean, prediction.variance), axis=0).max() < 1e-6
    assert model.mean_[0, 1].any()
