"""The linguistic tree: syllables, words and phrases of an aligned utterance."""

import tracemalloc
from itertools import pairwise

import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.text.syllables import syllable_starts
from dnnvss.text.tree import linguistic_tree
from dnnvss.timing import Alignment, Tier


def aligned(*words: str) -> Alignment:
    """Each word is ``label=PH PH PH``; one phone lasts 0.1 s; ``=sil`` is a pause."""
    phones, tier, time = [], [], 0
    for word in words:
        label, spelling = word.split("=")
        start = time
        for phone in spelling.split():
            phones.append((time / 10, (time + 1) / 10, phone))
            time += 1
        tier.append((start / 10, time / 10, label))
    return Alignment([Tier("phones", phones), Tier("words", tier)])


@pytest.mark.parametrize(("phones", "syllables"), [
    ("HH AH L OW", "HH AH.L OW"),
    ("EH K S T R AH", "EH K.S T R AH"),
    ("P AA R T N ER", "P AA R T.N ER"),
    ("S IH NG ER", "S IH NG.ER"),
    ("AE T L AH S", "AE T.L AH S"),
    ("IH N S T R AH K SH AH N", "IH N.S T R AH K.SH AH N"),
    ("K AH M P Y UW T ER", "K AH M.P Y UW.T ER"),
    ("IY EY", "IY.EY"),
    ("HH M", "HH M"),
    ("P ER1 S AH0 N", "P ER1.S AH0 N"),
])
def test_maximal_onset(phones: str, syllables: str) -> None:
    parts = phones.split()
    starts = syllable_starts(parts)
    cut = [" ".join(parts[a:b]) for a, b in zip(starts, [*starts[1:], None], strict=True)]
    assert ".".join(cut) == syllables


def test_hand_worked_utterance() -> None:
    tree = linguistic_tree(
        aligned("=sil", "hello=HH AH L OW", "now=N AW", "=sp", "come=K AH M", "again=AH G EH N", "=sil"),
        "Hello now. Come again!",
    )
    assert tree.word.tolist() == [-1, 0, 0, 0, 0, 1, 1, -1, 2, 2, 2, 3, 3, 3, 3, -1]
    assert tree.syllable.tolist() == [-1, 0, 0, 1, 1, 2, 2, -1, 3, 3, 3, 4, 5, 5, 5, -1]
    assert tree.phrase.tolist() == [-1, 0, 0, 0, 0, 0, 0, -1, 1, 1, 1, 1, 1, 1, 1, -1]
    assert tree.phone_in_syllable.tolist() == [-1, 0, 1, 0, 1, 0, 1, -1, 0, 1, 2, 0, 0, 1, 2, -1]
    assert tree.phones_in_syllable.tolist() == [0, 2, 2, 2, 2, 2, 2, 0, 3, 3, 3, 1, 3, 3, 3, 0]
    assert tree.phone_in_word.tolist() == [-1, 0, 1, 2, 3, 0, 1, -1, 0, 1, 2, 0, 1, 2, 3, -1]
    assert tree.syllable_in_word.tolist() == [-1, 0, 0, 1, 1, 0, 0, -1, 0, 0, 0, 0, 1, 1, 1, -1]
    assert tree.syllables_in_phrase.tolist() == [0, *[3] * 6, 0, *[3] * 7, 0]
    assert tree.syllable_in_phrase.tolist() == [-1, 0, 0, 1, 1, 2, 2, -1, 0, 0, 0, 1, 2, 2, 2, -1]
    assert tree.word_in_phrase.tolist() == [-1, 0, 0, 0, 0, 1, 1, -1, 0, 0, 0, 1, 1, 1, 1, -1]
    assert tree.words_in_phrase.max() == 2
    assert tree.stress.tolist() == [-1, 0, 0, 1, 1, 1, 1, -1, 1, 1, 1, 0, 1, 1, 1, -1]
    assert np.flatnonzero(tree.vowel).tolist() == [2, 4, 6, 9, 11, 13]
    assert (tree.phones, tree.syllables, tree.words, tree.phrases) == (13, 6, 4, 2)


def test_phrases_without_punctuation_split_at_sil_but_not_at_sp() -> None:
    words = ["one=W AH N", "=sil", "two=T UW", "=sp", "three=TH R IY"]
    assert linguistic_tree(aligned(*words), "one two three").phrase.tolist() == [0, 0, 0, -1, 1, 1, -1, 1, 1, 1]


def test_punctuation_is_matched_by_order_where_text_and_tier_agree() -> None:
    words = ["i=AY", "have=HH AE V", "twenty=T W EH N T IY", "cats=K AE T S", "but=B AH T", "no=N OW"]
    tree = linguistic_tree(aligned(*words), "I have 20 cats, but - no")
    assert tree.phrases == 3 and tree.word[np.flatnonzero(np.diff(tree.phrase))].tolist() == [3, 4]
    assert linguistic_tree(aligned(*words), "Something else, entirely.").phrases == 1
    assert linguistic_tree(aligned(*words), "").phrases == 1


def test_long_phrases_are_cut_near_the_middle_before_a_joining_word() -> None:
    names = ["we", "went", "down", "the", "old", "road", "again", "and", "then", "we", "came", "back", "home"]
    long = aligned(*(f"{name}=AH" for name in names))
    assert linguistic_tree(long, " ".join(names)).phrase.tolist() == [0] * 7 + [1] * 6
    assert linguistic_tree(aligned(*(f"{n}=AH" for n in names[:12])), "").phrases == 1
    plain = linguistic_tree(aligned(*(f"w{k}=AH" for k in range(30))), "")
    assert [int((plain.phrase == p).sum()) for p in range(plain.phrases)] == [7, 8, 7, 8]
    paused = aligned(*(f"{n}=AH" for n in names[:8]), "=sil", *(f"{n}=AH" for n in names[8:]))
    assert linguistic_tree(paused, "").phrases == 2


def test_silence_inside_a_word_and_phones_inside_a_pause() -> None:
    tree = linguistic_tree(aligned("=sil", "hello=HH AH sil L OW", "=N AW"), "hello")
    assert tree.word.tolist() == [-1, 0, 0, -1, 0, 0, 0, 0]
    assert tree.phrase.tolist() == [-1, 0, 0, -1, 0, 0, 0, 0]
    assert linguistic_tree(aligned("=sil N AW"), "").word.tolist() == [-1, 0, 0]


def test_silence_alone_has_nothing() -> None:
    tree = linguistic_tree(aligned("=sil"), "hello.")
    assert (tree.words, tree.phrases, tree.syllable.tolist()) == (0, 0, [-1])


def test_unknown_phone_and_missing_tier_are_errors() -> None:
    with pytest.raises(DnnvssError, match="unknown phone 'QQ'"):
        linguistic_tree(aligned("a=QQ"), "a")
    with pytest.raises(DnnvssError, match="no tier 'words'"):
        linguistic_tree(Alignment([Tier("phones", [(0, 1, "sil")])]), "a")


def nearest_word(phones: Tier, words: Tier) -> np.ndarray:
    """Oracle: every phone against every word, the first of the nearest ones."""
    middles = (phones.edges[:-1] + phones.edges[1:]) / 2
    named = np.array([i for i, label in enumerate(words.labels) if label.strip()] or range(len(words)))
    starts, ends = words.edges[:-1][named], words.edges[1:][named]
    distance = np.maximum(np.maximum(starts - middles[:, None], middles[:, None] - ends), 0.0)
    return named[distance.argmin(axis=1)]


def test_a_phone_belongs_to_the_nearest_word() -> None:
    rng = np.random.default_rng(3)
    for _ in range(200):
        count, parts = rng.integers(1, 30), rng.integers(1, 12)
        edges = np.sort(rng.choice(100, count + 1, replace=False)) / 10
        inner = rng.choice(np.arange(1, 1000), parts - 1, replace=False) / 1000
        bounds = np.sort(np.r_[0, inner, 1]) * (edges[-1] - edges[0]) + edges[0]
        phones = Tier("phones", [(a, b, "AA") for a, b in pairwise(edges)])
        words = Tier("words", [(a, b, str(rng.choice(["", "a", "b"]))) for a, b in pairwise(bounds)])
        owners = np.unique(nearest_word(phones, words), return_inverse=True)[1]
        assert linguistic_tree(Alignment([phones, words]), "").word.tolist() == owners.tolist()


def long_alignment(words: list[str]) -> Alignment:
    """Each word is N AW, 0.2 s long."""
    return aligned(*[f"{word}=N AW" for word in words])


def test_punctuation_of_a_long_text_is_found_where_text_and_tier_differ() -> None:
    names = [f"{a}{b}" for a in ("red", "blue", "green", "white") for b in ("bird", "berry", "house", "wood")]
    rng = np.random.default_rng(0)
    written = [str(rng.choice(names)) for _ in range(1500)]
    tier = [word for i, word in enumerate(written) if i % 97 != 50]  # words that the tier lacks
    text = " ".join(word + ("." if i % 10 == 9 else "") for i, word in enumerate(written))
    phrase = linguistic_tree(long_alignment(tier), text).phrase[::2]
    ends = {i for i, (a, b) in enumerate(pairwise(phrase)) if a != b}
    kept = [i for i in range(len(written)) if i % 97 != 50]
    expected = {place for place, i in enumerate(kept[:-1]) if i % 10 == 9}
    assert len(expected) > 140
    assert len(ends & expected) > 0.98 * len(expected)
    assert len(ends - expected) < 0.02 * len(expected)


def test_memory_grows_with_the_words() -> None:
    alignment, text = long_alignment(["now"] * 3000), "now " * 3000
    tracemalloc.start()
    try:
        tree = linguistic_tree(alignment, text)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert tree.words == 3000
    assert tree.words_in_phrase.max() <= 12
    assert peak < 15e6  # every phone against every word would be 144 MB
