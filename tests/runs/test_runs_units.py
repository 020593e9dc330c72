"""Dynamic visemes of a corpus are kept as they are used."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from conftest import CLOCK

from dnnvss.runs import corpus_visemes
from dnnvss.runs.corpus_visemes import CorpusUnits
from dnnvss.systems.viseme_predictor import UnitModel
from dnnvss.timing import Tier


class KeptModel:
    """Stands in for a model: what it saves is what is loaded."""

    def save(self, path: Path) -> None:
        path.parent.mkdir(parents=True)
        path.write_text("model")


def test_a_run_that_goes_on_has_the_units_of_the_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    edges = np.cumsum([0.0, 1 / 3, 1e-7, np.pi / 10, 1001 / 30000])
    tiers = [Tier("visemes", zip(edges[:-1] * k, edges[1:] * k, "0123", strict=True)) for k in (1, 1.1, 1 / 7)]
    made = CorpusUnits(cast(UnitModel, KeptModel()), {"a": tiers[0]}, {"a": tiers[1:]})
    fits: list[int] = []
    monkeypatch.setattr(corpus_visemes, "_learn", lambda *given: fits.append(1) or made)
    monkeypatch.setattr(UnitModel, "load", classmethod(lambda cls, path: path.read_text()))
    given: Any = (SimpleNamespace(root=tmp_path), SimpleNamespace(key="face"), "own", CLOCK, SimpleNamespace(key="k"),
                  tmp_path / "scratch")
    first, again = corpus_visemes.corpus_units(*given), corpus_visemes.corpus_units(*given)
    assert fits == [1]
    assert first == again
    assert first.oracle == made.oracle and first.predicted == made.predicted

