"""A long text is found in a long sound: what was recognised, between which pauses, and where utterances are parted."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dnnvss.speech import matching
from dnnvss.speech.activity import louder, stretches
from dnnvss.speech.grams import trigrams
from dnnvss.speech.matching import OTHER, SKIP, matched, settled, trusted
from dnnvss.speech.passages import Passage, passages, widened
from dnnvss.speech.recognise import HeardWord
from dnnvss.speech.utterances import Timed, edges, utterances


def cost(text: list[int], heard: list[int], found: np.ndarray) -> float:
    pairs = [(text[k], word) for k, word in zip(found, heard, strict=True) if k >= 0]
    return sum(OTHER * (a != b) for a, b in pairs) + SKIP * (len(text) + len(heard) - 2 * len(pairs))


def least(text: list[int], heard: list[int]) -> float:
    """The edit distance, by the plain recursion."""
    table = np.zeros((len(text) + 1, len(heard) + 1))
    table[:, 0], table[0] = SKIP * np.arange(len(text) + 1), SKIP * np.arange(len(heard) + 1)
    for a, b in product(range(len(text)), range(len(heard))):
        table[a + 1, b + 1] = min(table[a, b] + OTHER * (text[a] != heard[b]), table[a, b + 1] + SKIP,
                                  table[a + 1, b] + SKIP)
    return float(table[-1, -1])


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(0, 4), min_size=1, max_size=25), st.lists(st.integers(0, 4), min_size=1, max_size=25),
       st.sampled_from([1, 30, 10**6]))
def test_the_cheapest_match_is_found_in_any_memory(text: list[int], heard: list[int], whole: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(matching, "_WHOLE", whole)
        found = matched(text, heard)
    places = found[found >= 0]
    assert (np.diff(places) > 0).all() and cost(text, heard, found) == pytest.approx(least(text, heard))


def test_what_is_left_out_lies_between_pauses() -> None:
    heard = [1, 2, 3, 1, 4, 5, 1, 6, 7]  # 1 2 3 | 1 4 5 | 1 6 7, and the text has 1 2 3 1 6 7
    pauses = np.array([9, 0, 0, 1, 0, 0, 1, 0, 0, 9.0])
    want = [0, 1, 2, -1, -1, -1, 3, 4, 5]
    for given_ in (want, [0, 1, 2, 3, -1, -1, -1, 4, 5]):
        assert settled(np.array(given_), heard, pauses).tolist() == want
    nearly = settled(np.array([0, 1, 2, 3, -1, -1, -1, 4, 5]), [1, 2, 3, 1, 4, 5, 9, 6, 7], pauses)
    assert nearly.tolist() == want  # 9 was heard for 1
    back = settled(np.array([-1, -1, -1, 0, 1, 2]), [1, 2, 3, 1, 2, 3], np.array([0, 0, 0, 0, 0, 0, 1.0]))
    assert back.tolist() == [0, 1, 2, -1, -1, -1]


def test_words_that_agree_by_chance_are_not_trusted() -> None:
    text = list(range(30))
    heard = [0, 1, 2, 3, 99, 5, 6, *[50] * 6, 15, *[50] * 6, 24, 25, 26, 27]
    found = matched(text, heard)
    good = trusted(text, heard, found)
    assert good[:7].all() and good[-4:].all() and not good[7:-5].any()


def test_chances_of_what_follows_sum_to_one() -> None:
    """With the weight of going back to fewer words, as the format defines it."""
    words = list("abacabdaba")
    rows = [line.split() for line in trigrams(words).splitlines() if line and line[0] in "-0123456789"]
    grams = {}
    for row in rows:
        back = len(row) > 2 and row[-1][0] in "-0"  # the weight of going back
        grams[tuple(row[1:-1] if back else row[1:])] = 10 ** float(row[0]), 10 ** float(row[-1]) if back else 1.0

    def chance(history: tuple[str, ...], word: str) -> float:
        if (*history, word) in grams:
            return grams[(*history, word)][0]
        return grams.get(history, (0, 1.0))[1] * chance(history[1:], word)

    for history in ((), ("a",), ("b",), ("a", "b"), ("b", "a")):
        assert sum(chance(history, word) for word in ("a", "b", "c", "d")) == pytest.approx(
            1 if history else 1 - grams[("</s>",)][0], abs=0.1)


def heard_at(*rows: tuple[int, float]) -> list[HeardWord]:
    return [HeardWord(word, start, start + 0.3) for word, start in rows]


def test_passages_lie_between_pauses_and_take_words_where_there_is_time_for_them() -> None:
    spans = [(0.0, 1.0), (2.0, 3.0), (4.0, 5.5)]
    heard = heard_at((0, 0.0), (1, 0.35), (2, 0.7), (3, 2.0), (4, 2.65), (6, 4.6), (7, 5.1))
    places, good = np.array([0, 1, 2, 3, 4, 6, 7]), np.ones(7, bool)
    assert passages(spans, heard, places, good, 8) == [Passage(0, 1, 0, 3), Passage(2, 3, 3, 5), Passage(4, 5.5, 5, 8)]
    good[3:5] = False  # nothing known in the middle: the words between are tried there
    assert passages(spans, heard, places, good, 8)[1] == Passage(2, 3, 3, 6)
    far = np.array([0, 1, 2, 40, 41, 42, 43])
    assert passages(spans[:2], heard[:5], far[:5], np.ones(5, bool), 50) == [Passage(0, 1, 0, 3), Passage(2, 3, 40, 42)]


def test_a_word_that_is_heard_from_the_silence_before_it_belongs_to_its_speech() -> None:
    spans = [(0.0, 1.0), (1.3, 1.4), (2.0, 3.0)]  # a click between two sentences
    heard = [*heard_at((0, 0.0), (1, 0.35), (2, 0.7)), HeardWord(3, 1.35, 2.3), *heard_at((4, 2.35), (5, 2.7))]
    found = passages(spans, heard, np.arange(6), np.ones(6, bool), 6)
    assert found == [Passage(0, 1, 0, 3), Passage(2, 3, 3, 6)]


def test_passages_that_do_not_fit_are_tried_with_their_neighbours() -> None:
    found = [Passage(k, k + 0.9, 2 * k, 2 * k + 2) for k in range(4)]
    tried = widened(found, [False, True, True, False])
    assert tried[0] == (1, 3, Passage(1, 2.9, 2, 6))
    assert {(a, b) for a, b, _ in tried} == {(1, 3), (0, 3), (1, 4), (0, 4)}
    assert widened(found, [False] * 4) == [] and widened(found[:1], [True]) == []


def said(*starts: float | None) -> list[Timed | None]:
    return [None if t is None else Timed(t, t + 0.3, -10.0) for t in starts]


def test_utterances_end_with_sentences_at_pauses_and_where_words_were_not_found() -> None:
    ends = [False, True, False, False, True, False]
    assert utterances(said(0, 0.4, 1.0, 1.5, 1.9, 2.4), ends) == [(0, 2), (2, 5), (5, 6)]
    assert utterances(said(0, 0.4, 0.71, 1.0, None, 2.4), ends) == [(0, 4), (5, 6)]
    assert utterances(said(0, 0.4, 0.7, 1.7, 2.0, 2.2), [False] * 6) == [(0, 3), (3, 6)]
    long = said(*(0.35 * k + (0.15 if k >= 20 else 0) for k in range(40)))
    assert utterances(long, [False] * 40) == [(0, 20), (20, 40)]
    assert utterances(said(None, None), [False] * 2) == []


def test_what_is_kept_around_an_utterance_ends_before_a_breath() -> None:
    loud = np.zeros(400, bool)
    loud[100:200] = loud[222:240] = True  # words to 2 s, a breath at 2.22 s
    first, last = Timed(1.0, 1.4, 0), Timed(1.5, 2.0, 0)
    assert edges(first, last, loud, 0.0, 4.0) == pytest.approx((0.7, 2.22))
    assert edges(first, last, loud, 0.9, 2.1) == pytest.approx((0.95, 2.05))
    assert edges(first._replace(start=1.2), last._replace(end=1.9), loud, 0.0, 4.0) == pytest.approx((0.7, 2.22))


def test_pauses_are_told_from_noise_that_rises_for_a_moment() -> None:
    level = np.full(500, -50.0) + np.random.default_rng(0).normal(0, 3, 500)
    level[100:200] = level[230:300] = -12
    level[400:403] = -10
    heard = louder(level)
    np.testing.assert_allclose(stretches(heard), [(1.0, 2.0), (2.3, 3.0)], atol=0.05)
    assert stretches(louder(np.full(100, -90.0))) == []
