"""The semi-Markov decoder against every possible sequence, and what it is told about sequences by hand."""

from itertools import combinations, product

import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.timing import FrameClock, Tier
from dnnvss.visemes import DecodingSettings, Evidence, Grammar, sample, unit_scores, viterbi

SEQUENCES = [(np.array([0, 1, 2, 0]), np.array([3, 2, 1, 2])), (np.array([0, 2, 0]), np.array([2, 3, 3])),
             (np.array([1, 0]), np.array([1, 4]))]
SETTINGS = DecodingSettings(frames=0.7, prior=0.4, cuts=0.9, durations=1.1, follow=0.8)


@pytest.fixture
def grammar() -> Grammar:
    return Grammar.of(SEQUENCES, 3)


def evidence(frames: int = 6, units: int = 3, seed: int = 0) -> Evidence:
    random = np.random.default_rng(seed)
    logits = 2 * random.normal(size=(frames, units))
    return Evidence(logits - np.log(np.exp(logits).sum(1, keepdims=True)), 2 * random.normal(size=frames))


def score(seen: Evidence, g: Grammar, s: DecodingSettings, edges: tuple[int, ...], units: tuple[int, ...]) -> float:
    total = s.follow * (g.first[units[0]] + g.last[units[-1]])
    for i, unit in enumerate(units):
        length = edges[i + 1] - edges[i]
        if length > len(g.duration):
            return -np.inf
        total += s.durations * g.duration[length - 1, unit]
        for t in range(edges[i], edges[i + 1]):
            total += s.frames * (seen.units[t, unit] - s.prior * g.share[unit])
        if i:
            total += s.cuts * seen.cuts[edges[i]] + s.follow * g.follow[units[i - 1], unit]
    return total


def every_sequence(frames: int, units: int) -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
    return [((0, *inner, frames), chosen) for count in range(frames) for inner in combinations(range(1, frames), count)
            for chosen in product(range(units), repeat=count + 1)]


@pytest.mark.parametrize("seed", range(5))
def test_viterbi_finds_the_best_of_all_sequences(grammar: Grammar, seed: int) -> None:
    seen = evidence(seed=seed)
    edges, units = max(every_sequence(6, 3), key=lambda s: score(seen, grammar, SETTINGS, *s))
    found = viterbi(seen, grammar, SETTINGS)
    assert found[0].tolist() == list(edges) and found[1].tolist() == list(units)


def test_samples_come_as_often_as_their_scores_say(grammar: Grammar) -> None:
    seen = evidence(frames=3, seed=7)
    every = every_sequence(3, 3)
    weights = np.exp([score(seen, grammar, SETTINGS, *s) for s in every])
    expected = weights / weights.sum()
    drawn = sample(seen, grammar, SETTINGS, 4000, seed=1)
    counts = dict.fromkeys(every, 0)
    for edges, units in drawn:
        counts[tuple(edges.tolist()), tuple(units.tolist())] += 1
    assert np.abs(np.array([counts[s] for s in every]) / 4000 - expected).max() < 0.03


def test_samples_depend_on_the_seed_alone(grammar: Grammar) -> None:
    first, again = (sample(evidence(40), grammar, SETTINGS, 3, seed=5) for _ in range(2))
    assert all((a[0] == b[0]).all() and (a[1] == b[1]).all() for a, b in zip(first, again, strict=True))


def test_a_stretch_longer_than_any_unit_is_filled_by_several(grammar: Grammar) -> None:
    seen = Evidence(np.log(np.tile([0.98, 0.01, 0.01], (11, 1))), np.full(11, -9.0))
    edges, units = viterbi(seen, grammar, SETTINGS)
    assert np.diff(edges).max() <= 4 and edges[-1] == 11 and (units == 0).all()


def test_bigram_is_that_of_witten_and_bell(grammar: Grammar) -> None:
    """Unit 0 is followed by 1, by 2 and three times by the end; units and end stand 5, 2, 2 and 3 times after one."""
    after = np.array([5, 2, 2, 3]) + 1
    expected = (np.array([0, 1, 1, 3]) + 3 * after / after.sum()) / (5 + 3)
    assert np.exp([*grammar.follow[0], grammar.last[0]]) == pytest.approx(expected)
    assert np.exp(grammar.follow).sum(1) + np.exp(grammar.last) == pytest.approx(np.ones(3))
    assert np.exp(grammar.duration).sum(0) == pytest.approx(np.ones(3)) and len(grammar.duration) == 4
    assert np.exp(grammar.share) == pytest.approx((np.array([14, 3, 4]) + 1) / 24)


def test_durations_are_near_those_that_were_seen() -> None:
    long = [(np.array([0, 1] * 30), np.array([4, 12] * 30))]
    assert Grammar.of(long, 2).duration.argmax(0) == pytest.approx([3, 11], abs=1)


def test_grammar_survives_a_checkpoint(grammar: Grammar) -> None:
    again = Grammar.from_description(grammar.describe())
    assert all((getattr(again, n) == getattr(grammar, n)).all() for n in ("follow", "first", "last", "duration"))


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(DnnvssError, match="no sequence"):
        Grammar.of([], 3)
    with pytest.raises(DnnvssError, match=r"decoding\.cuts=-1 is too little"):
        DecodingSettings(cuts=-1)


def test_scores_of_predicted_units_by_hand() -> None:
    """True 0 1 2 0 with cuts at 3, 6, 8; found 0 2 0 with cuts at 4, 8: one edit, one cut exact and one a frame off."""
    clock = FrameClock(100)
    true = Tier("visemes", [(0, 0.03, "0"), (0.03, 0.06, "1"), (0.06, 0.08, "2"), (0.08, 0.1, "0")])
    found = Tier("visemes", [(0, 0.04, "0"), (0.04, 0.08, "2"), (0.08, 0.1, "0")])
    scores = unit_scores([(found, true)], clock, (0, 1))
    assert scores.frames == pytest.approx(0.7) and scores.moving == pytest.approx(2 / 5)
    assert scores.sequence == pytest.approx(3 / 4)
    assert scores.f1 == pytest.approx({0: 2 / 5, 1: 4 / 5}) and scores.error == pytest.approx(10 * (1 + 2 + 0) / 3)
