"""The linguistic tree: syllables, words and phrases of an aligned utterance."""

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
