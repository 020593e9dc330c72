"""What a phone's duration depends on: its context as names, and as ones and zeros."""

from collections.abc import Iterator, Sequence
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from dnnvss.phones import ARTICULATION, SILENCE
from dnnvss.text.tree import LinguisticTree, linguistic_tree
from dnnvss.timing import Alignment

if TYPE_CHECKING:
    import scipy.sparse

ALWAYS = "always"
"""The context of every phone."""


@cache
def phone_class(phone: str) -> str:
    """Return a phone's class for durations: its manner, ``-`` if voiceless; vowels tense, lax or gliding."""
    a = ARTICULATION[phone]
    if a.manner == "vowel":
        return "diphthong" if a.glide else "tense" if a.tense else "lax"
    return a.manner if a.voiced or a.manner == "silence" else f"{a.manner}-"


def spoken_contexts(alignment: Alignment, text: str) -> tuple[list[list[str]], np.ndarray]:
    """Return the context features of each spoken phone, and the durations (n,) in seconds.

    A row begins with the phone, its class and ``always``.

    Args:
        alignment: with tiers ``phones`` and ``words``.
        text: the words as written.
    """
    rows, seconds = each_context(alignment, text)
    return list(rows), seconds


def each_context(alignment: Alignment, text: str) -> tuple[Iterator[list[str]], np.ndarray]:
    """The same with the rows one by one."""
    tree = linguistic_tree(alignment, text)
    padded = (SILENCE, SILENCE, *alignment["phones"].labels, SILENCE, SILENCE)
    spoken = np.flatnonzero(tree.word >= 0)
    places = _places(tree)
    counted = (tree.syllable_in_word, tree.syllables_in_word, tree.word_in_phrase, tree.words_in_phrase, tree.phrase,
               tree.phones_in_syllable, tree.phones_in_word)
    counts = list(zip(*(array.tolist() for array in counted), strict=True))
    rows = (_context(padded[i : i + 5], places[i], tree.phrases, *counts[i]) for i in spoken.tolist())
    return rows, np.diff(alignment["phones"].edges)[spoken]


def _context(window: Sequence[str], place: str, phrases: int, syllable: int, syllables: int, word: int, words: int,
             phrase: int, phones: int, length: int) -> list[str]:
    """Return the feature names of a segment at a place in its syllable, in the middle of five labels.

    Args:
        window: the labels.
        place: onset, nucleus or coda.
        phrases: of the utterance.
        syllable, syllables: of its word: which one, and how many.
        word, words: of its phrase.
        phrase: which one.
        phones, length: how many in its syllable, and in its word.
    """
    far_left, left, own, right, far_right = window
    kind = phone_class(own)
    last_syllable = syllable == syllables - 1
    final = last_syllable and word == words - 1
    end = final and phrase == phrases - 1
    ending = "end" if end else "final" if final else "word" if last_syllable else "inner"
    first = syllable == 0 and word == 0
    return [
        own, f"class={kind}", ALWAYS, f"left={left}", f"right={right}", f"left class={phone_class(left)}",
        f"right class={phone_class(right)}", f"left class 2={phone_class(far_left)}",
        f"right class 2={phone_class(far_right)}", f"{kind} before {phone_class(right)}", f"{kind} {place}",
        f"{kind} {ending}", f"{own} {ending}", f"{own} {place}", f"{place} {ending}", f"first={first} {place}",
        f"syllables={min(syllables, 4)} {kind == 'lax'}",
        f"syllable={min(syllable, 3)}",
        f"phones={min(phones, 5)} {place}",
        f"words before={min(word, 6)}",
        f"words after={min(words - 1 - word, 6)}",
        f"word length={min(length, 8)}", f"{left} {own}", f"{own} {right}",
    ]  # fmt: skip


def _places(tree: LinguisticTree) -> list[str]:
    """Where in its syllable each segment stands: onset, nucleus or coda."""
    nuclei = np.full(tree.syllables + 1, -1)  # the last place is that of silences
    vowels = np.flatnonzero(tree.vowel)[::-1]
    nuclei[tree.syllable[vowels]] = vowels  # the first of each syllable is written last
    onset = np.arange(len(tree.syllable)) < nuclei[tree.syllable]
    return ["nucleus" if v else "onset" if o else "coda" for v, o in zip(tree.vowel, onset, strict=True)]


def context_matrix(places: np.ndarray, columns: int) -> "scipy.sparse.csr_matrix":
    """Return contexts as ones and zeros (n, columns), the ones alone stored, from the columns (n, K) of each row."""
    from scipy.sparse import csr_matrix  # slow to import, and needed where a model is fitted

    rows = np.arange(places.size + 1, step=places.shape[1])
    x = csr_matrix((np.ones(places.size), places.ravel(), rows), (len(places), columns))
    x.sum_duplicates()  # a name may stand twice in a row
    x.data[:] = 1.0
    return x
