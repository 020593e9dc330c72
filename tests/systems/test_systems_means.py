"""The null models count the frames that the codes have, wherever the alignment begins."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import CLOCK, TABLE

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
