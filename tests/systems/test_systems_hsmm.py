"""The HMM baseline: what is drawn from a known model is found again; searches agree with trying everything."""

from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from conftest import CLOCK, TABLE

from dnnvss.errors import DnnvssError
from dnnvss.features import encode, phones_of
from dnnvss.phones import PHONES, SPOKEN
from dnnvss.systems import Example
from dnnvss.systems.hsmm import HiddenSemiMarkov
from dnnvss.systems.hsmm_contexts import context_answers, context_questions
from dnnvss.systems.hsmm_durations import best_durations, equal_states
from dnnvss.systems.trees import Growth, Sums, grow
from dnnvss.timing import Alignment, Tier

MEANS = np.array([[0, 8], [10, 0], [20, -9], [10, 9], [0, 0]], dtype=float)  # (5, 2), states far apart
MOVED = np.array([5.0, -4.0])  # what a following closure adds
LASTING = np.array([3, 2, 4, 2, 3])
ROOT = "phone after: Do the lips close?"


def example_of(name: str, phones: list[str], frames: np.ndarray, targets: np.ndarray | None = None) -> Example:
    edges = np.cumsum([0, *frames]) / 100
    tier = Tier("phones", zip(edges[:-1], edges[1:], phones, strict=True))
    alignment = Alignment([tier, Tier("words", [(0.0, edges[-1], "word")])])
    valid = None if targets is None else np.ones(len(targets), dtype=bool)
    return Example(name, alignment, encode(alignment, "word", TABLE, CLOCK), targets, valid)


def drawn(name: str, rng: np.random.Generator) -> tuple[Example, np.ndarray, np.ndarray]:
    """Return an utterance drawn from the known model, its state durations and which phones a closure follows."""
    phones = [str(p) for p in rng.choice(SPOKEN, 30)]
    durations = LASTING + rng.integers(-1, 2, (30, 5))
    closed = np.array([p in ("B", "M", "P") for p in phones[1:]] + [False])
    mean = (MEANS + closed[:, None, None] * MOVED).reshape(-1, 2)
    targets = np.repeat(mean, durations.ravel(), 0) + rng.normal(size=(durations.sum(), 2))
    example = example_of(name, phones, durations.sum(1), targets[:, None].astype(np.float32))
    return example, durations, closed


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> tuple[HiddenSemiMarkov, list, list]:
    rng = np.random.default_rng(3)
    rows = [drawn(f"u{i}", rng) for i in range(40)]
    model = HiddenSemiMarkov(TABLE, CLOCK, HiddenSemiMarkov.Settings(Growth(3.0, 10), Growth(3.0), realignments=3))
    model.fit([r[0] for r in rows], [], tmp_path_factory.mktemp("hsmm"))
    return model, rows, [drawn(f"t{i}", rng) for i in range(4)]


def test_tree_asks_what_the_data_were_drawn_by(known: tuple) -> None:
    for tree in known[0].states_:
        assert context_questions()[tree.question[0]] == ROOT and len(tree.count) == 2
    assert f"state 1: 2 leaves\n{ROOT}\n  yes: leaf 0" in known[0].describe_trees()


def test_means_come_back_within_three_standard_errors(known: tuple) -> None:
    model, rows, _ = known
    for state, tree in enumerate(model.states_):
        for leaf, moved in ((0, MOVED), (1, 0)):
            error = 1 / np.sqrt(tree.count[leaf])
            assert (np.abs(tree.mean[leaf] - MEANS[state] - moved) < 3 * error).all()
            np.testing.assert_allclose(tree.variance[leaf], 1, atol=6 / np.sqrt(tree.count[leaf]))
    lasting = np.concatenate([durations for _, durations, _ in rows])
    np.testing.assert_allclose(model.durations_.mean[0], LASTING, atol=3 * lasting.std(0).max() / np.sqrt(len(lasting)))


def test_unseen_sentences_are_predicted_by_their_states(known: tuple) -> None:
    for example, durations, closed in known[2]:
        prediction = known[0].predict(example)
        states = known[0].state_durations(example)
        np.testing.assert_array_equal(states.sum(1), durations.sum(1))
        expected = np.repeat((MEANS + closed[:, None, None] * MOVED).reshape(-1, 2), states.ravel(), 0)
        np.testing.assert_allclose(prediction.mean[:, 0], expected, atol=0.5)
        np.testing.assert_allclose(known[0].phone_durations(example), LASTING.sum(), atol=0.5)


@pytest.mark.parametrize("frames", [1, 3, 5, 9, 12])
@pytest.mark.parametrize("seen", [False, True])
def test_durations_are_the_best_of_all(frames: int, seen: bool) -> None:
    rng = np.random.default_rng(frames)
    mean, variance = rng.uniform(0.5, 4, (3, 5)), rng.uniform(0.3, 3, (3, 5))
    density = rng.normal(scale=3, size=(3, frames, 5)) if seen else None
    found = best_durations(frames, mean, variance, density)
    least = 1 if frames >= 5 else 0
    every = np.array([d for d in product(range(least, frames + 1), repeat=5) if sum(d) == frames])
    for g in range(3):
        score = (-0.5 * (every - mean[g]) ** 2 / variance[g]).sum(1)
        if density is not None:
            score += [density[g, np.arange(frames), np.repeat(np.arange(5), d)].sum() for d in every]
        np.testing.assert_array_equal(found[g], every[score.argmax()])


def test_equal_states_share_every_phone() -> None:
    frames = np.arange(1, 40)
    shares = equal_states(frames)
    np.testing.assert_array_equal(shares.sum(1), frames)
    assert (np.ptp(shares, axis=1) <= 1).all() and equal_states(np.array([10])).tolist() == [[2] * 5]


def split_likelihood(values: np.ndarray, yes: np.ndarray) -> float:
    return sum(-0.5 * len(v) * np.log(v.var(0)).sum() for v in (values[yes], values[~yes]))


def test_first_question_is_the_best_of_all() -> None:
    rng = np.random.default_rng(0)
    answers, values = rng.random((300, 12)) < 0.5, rng.normal(size=(300, 4))
    values[answers[:, 7]] *= 1.6  # variance tells too, not the mean alone
    values[answers[:, 2]] += 0.5
    tree = grow(answers, Sums(np.ones(300), values, values**2), Growth(mdl=None, least_rows=20, least_count=20))
    assert tree.question[0] == np.argmax([split_likelihood(values, a) for a in answers.T])
    leaf = tree(answers)
    assert np.bincount(leaf).min() >= 20
    for k in np.unique(leaf):
        np.testing.assert_allclose(tree.mean[k], values[leaf == k].mean(0))
        np.testing.assert_allclose(tree.variance[k], values[leaf == k].var(0))


def test_what_is_asked_first_is_asked_of_all_that_said_no() -> None:
    rng = np.random.default_rng(0)
    code = rng.integers(0, 3, 300)
    answers = np.concatenate([code[:, None] == np.arange(4), rng.random((300, 5)) < 0.5], 1)
    values = 5.0 * answers[:, 5:6] * (code[:, None] == 2) + rng.normal(size=(300, 4))
    tree = grow(answers, Sums(np.ones(300), values, values**2), Growth(least_rows=5), first=(3, 0, 1, 2))
    assert tree.question[0] == 0 and tree.question[tree.no[0]] == 1  # column 3 tells nothing: nobody says yes
    last = tree.no[tree.no[0]]
    assert tree.question[last] == 5 and tree.leaf[tree.yes[0]] >= 0  # what is worth asking, and only where it is
    leaf = tree(answers)
    assert [len(np.unique(leaf[code == c])) for c in range(3)] == [1, 1, 2]


def test_description_length_stops_at_noise() -> None:
    rng = np.random.default_rng(0)
    answers, values = rng.random((500, 40)) < 0.5, rng.normal(size=(500, 4))
    sums = Sums(np.ones(500), values, values**2)
    assert len(grow(answers, sums, Growth()).question) == 1
    assert len(grow(answers, sums, Growth(mdl=None)).question) > 100


@pytest.mark.parametrize("rows", [0, 1, 3])
def test_too_little_data_leaves_one_leaf(rows: int) -> None:
    values = np.arange(rows * 2.0).reshape(rows, 2)
    tree = grow(np.ones((rows, 3), bool), Sums(np.ones(rows), values, values**2), Growth())
    assert tree(np.ones((2, 3), bool)).tolist() == [0, 0] and np.isfinite(tree.mean).all() and (tree.variance > 0).all()


def test_one_phone_of_too_few_frames_trains_and_speaks_and_says_so(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    example = example_of("short", ["AA"], np.array([3]), rng.normal(size=(3, 3, 2)).astype(np.float32))
    model = HiddenSemiMarkov(TABLE, CLOCK)
    model.fit([example], [], tmp_path)
    prediction = model.predict(example_of("long", ["B", "AA"], np.array([2, 9])))
    assert prediction.mean.shape == (11, 3, 2) and np.isfinite(prediction.mean).all()
    assert (prediction.variance > 0).all()
    assert "state 1: too little data for a question" in (tmp_path / "trees.txt").read_text()


def test_unmeasured_frames_do_not_count(tmp_path: Path, examples: dict) -> None:
    clean = examples["train"][0]
    valid = np.ones(len(clean.targets), dtype=bool)
    valid[20:30] = False
    spoilt = clean.targets.copy()
    spoilt[~valid] = 1e6

    def fitted(targets: np.ndarray) -> np.ndarray:
        model = HiddenSemiMarkov(TABLE, CLOCK)
        model.fit([Example("a", clean.alignment, clean.codes, targets, valid)], [], tmp_path)
        return model.predict(clean).mean

    np.testing.assert_array_equal(fitted(spoilt), fitted(clean.targets))


def test_nothing_measured_is_refused(tmp_path: Path, examples: dict) -> None:
    e = examples["train"][0]
    nothing = Example("a", e.alignment, e.codes, e.targets, np.zeros(len(e.targets), dtype=bool))
    with pytest.raises(DnnvssError, match="no frame of the training examples was measured"):
        HiddenSemiMarkov(TABLE, CLOCK).fit([nothing], [], tmp_path)


def test_answers_name_the_quinphone() -> None:
    example = example_of("q", ["sil", "P", "AA", "F", "sil"], np.full(5, 6))
    answers, questions = context_answers(phones_of(example.codes)), context_questions()
    assert answers.shape == (5, len(questions)) and len(set(questions)) == len(questions)
    ask: Callable[[int, str], bool] = lambda row, text: bool(answers[row, questions.index(text)])  # noqa: E731
    assert ask(2, "phone before: Is it P?") and ask(2, "second phone after: Is it sil?") and ask(1, ROOT) is False
    assert ask(0, ROOT) and ask(0, "phone before: Is it outside the utterance?")
    identity = answers[:, [questions.index(f"phone: Is it {p}?") for p in PHONES]]
    np.testing.assert_array_equal(identity.sum(1), 1)
