"""Models of dynamic visemes: movement drawn from known units is found again, and labels without units are refused."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from conftest import CLOCK, TABLE

from dnnvss.errors import DnnvssError
from dnnvss.features import FeatureTable, Settings, encode, visemes_of
from dnnvss.systems import Example
from dnnvss.systems.hsmm import HiddenSemiMarkovSettings
from dnnvss.systems.hsmm_visemes import VisemeHiddenSemiMarkov, unit_answers, unit_questions
from dnnvss.systems.registry import driven_by, make_system
from dnnvss.systems.trees import Growth
from dnnvss.timing import Alignment, Tier
from dnnvss.training.arrays import save_arrays
from dnnvss.training.learnt import read_learnt

UNITS = 4
UNIT_TABLE = FeatureTable(("centre_viseme",), Settings(units=UNITS))
MEANS = np.random.default_rng(7).normal(scale=6, size=(UNITS, 5, 2))
MOVED = np.array([4.0, -4.0])
"""What unit 3 adds where it comes next."""
GROWTH = HiddenSemiMarkovSettings(Growth(1.0, 5), Growth(1.0, 5), realignments=2)


def drawn(name: str, rng: np.random.Generator) -> tuple[Example, np.ndarray]:
    """An utterance of random units and the means that it was drawn by."""
    units = rng.integers(0, UNITS, 12)
    durations = np.full((12, 5), 3)
    edges = np.cumsum([0, *durations.sum(1)]) / 100
    spans = list(pairwise(edges.tolist()))
    end = float(edges[-1])
    alignment = Alignment([Tier("phones", [(0.0, end, "AA")]), Tier("words", [(0.0, end, "a")]),
                           Tier("visemes", [(a, b, str(u)) for (a, b), u in zip(spans, units, strict=True)])])
    moved = np.append(units[1:], 0) == 3
    mean = np.repeat((MEANS[units] + moved[:, None, None] * MOVED).reshape(-1, 2), durations.ravel(), 0)
    targets = (mean + rng.normal(scale=0.3, size=mean.shape))[:, None].astype(np.float32)
    codes = encode(alignment, "a", UNIT_TABLE, CLOCK)
    return Example(name, alignment, codes, targets, np.ones(len(mean), bool)), mean


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> VisemeHiddenSemiMarkov:
    rng = np.random.default_rng(1)
    model = VisemeHiddenSemiMarkov(UNIT_TABLE, CLOCK, GROWTH)
    model.fit([drawn(f"u{k}", rng)[0] for k in range(40)], [], tmp_path_factory.mktemp("units"))
    return model


def test_movement_of_known_units_is_given_back(fitted: VisemeHiddenSemiMarkov) -> None:
    example, mean = drawn("t", np.random.default_rng(5))
    said = fitted.predict(example)
    assert np.corrcoef(said.mean[:, 0].ravel(), mean.ravel())[0, 1] > 0.99
    np.testing.assert_array_equal(fitted.state_durations(example).sum(1), visemes_of(example.codes).frames)
    assert fitted.phone_durations(example) is None


def test_every_tree_asks_first_which_unit_it_is_then_for_what_comes_next(fitted: VisemeHiddenSemiMarkov) -> None:
    for tree in fitted.states_:
        asked = [fitted.questions()[q] for q in tree.question if q >= 0]
        assert fitted.questions()[tree.question[0]] == "unit: Is it 0?"
        assert asked.count("unit after: Is it 3?") == UNITS


def test_answers_of_units_by_hand() -> None:
    answers = unit_answers(np.array([2, 0]), np.array([0, 3]), 3)
    asked = np.array(unit_questions(3))
    assert set(asked[answers[0]]) == {
        "second unit before: Is it outside the utterance?", "unit before: Is it outside the utterance?",
        "unit: Is it 2?", "unit after: Is it 0?", "second unit after: Is it outside the utterance?",
        *(f"phones: At most {n}?" for n in range(5))}
    assert set(asked[answers[1]]) == {
        "second unit before: Is it outside the utterance?", "unit before: Is it 2?", "unit: Is it 0?",
        "unit after: Is it outside the utterance?", "second unit after: Is it outside the utterance?",
        "phones: At most 3?", "phones: At most 4?"}


def test_what_was_learnt_is_kept_and_other_units_are_refused(fitted: VisemeHiddenSemiMarkov, tmp_path: Path) -> None:
    save_arrays(tmp_path / "state.npz", fitted.state())
    other = VisemeHiddenSemiMarkov(UNIT_TABLE, CLOCK, GROWTH)
    other.load_state(read_learnt(tmp_path / "state.npz"))
    example, _ = drawn("t", np.random.default_rng(6))
    np.testing.assert_array_equal(other.predict(example).mean, fitted.predict(example).mean)
    more = VisemeHiddenSemiMarkov(FeatureTable(("centre_viseme",), Settings(units=UNITS + 1)), CLOCK, GROWTH)
    with pytest.raises(DnnvssError, match="ask other questions"):
        more.load_state(fitted.state())


def test_labels_without_units_are_refused() -> None:
    with pytest.raises(DnnvssError, match=r"made of dynamic visemes, and .* has none.*labels=dv"):
        make_system("hsmm_visemes", {}, TABLE, CLOCK)
    assert driven_by(VisemeHiddenSemiMarkov, UNIT_TABLE) == "text"
