"""Which phones belong to which word, where only the phones' times are known."""

from collections.abc import Sequence

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.phones import SILENCES, VOWELS
from dnnvss.timing import Tier

Word = tuple[str, Sequence[tuple[str, ...]]]

_REMEDY = "Give the text that belongs to the alignment, or an alignment with a tier of words"


def words_over(phones: Tier, words: Sequence[Word]) -> Tier:
    """Return the tier ``words`` over a tier of phones, pauses as ``""``.

    The phones are matched with the words' first pronunciations by the smallest edit distance (another phone costs 1,
    0.6 between two vowels or two consonants; a phone too many or too few 0.8). A phone too many goes to the word
    before it.

    Raises:
        DnnvssError: a word without a phone, or phones that differ from the words in more than half.
    """
    spoken = [k for k, s in enumerate(phones) if s.label not in SILENCES]
    expected = [(phone, index) for index, (_, ways) in enumerate(words) for phone in ways[0]]
    owners, cost = _matched([phones[k].label for k in spoken], expected)
    if cost > 0.5 * max(len(expected), 1):
        said = " ".join(phones[k].label for k in spoken)
        raise DnnvssError(f"the phones {said} are not those of {' '.join(w for w, _ in words)!r}", remedy=_REMEDY)
    missing = sorted(set(range(len(words))) - set(owners))
    if missing:
        raise DnnvssError(f"no phone is left for the word {words[missing[0]][0]!r}", remedy=_REMEDY)
    owner = dict(zip(spoken, owners, strict=True))
    rows: list[tuple[float, float, int]] = []
    for k, segment in enumerate(phones):
        word = owner.get(k, -1)
        before = max((i for i in spoken if i < k), default=None)
        after = min((i for i in spoken if i > k), default=None)
        if word < 0 and before is not None and after is not None and owner[before] == owner[after]:
            word = owner[before]  # a silence inside a word, such as a closure
        if rows and rows[-1][2] == word:
            rows[-1] = (rows[-1][0], segment.end, word)
        else:
            rows.append((segment.start, segment.end, word))
    return Tier("words", [(a, b, words[w][0] if w >= 0 else "") for a, b, w in rows])


def _matched(heard: Sequence[str], expected: Sequence[tuple[str, int]]) -> tuple[list[int], float]:
    """Return the word of each heard phone and the edit distance."""
    n, m = len(heard), len(expected)
    table = np.zeros((n + 1, m + 1))
    table[:, 0], table[0, :] = 0.8 * np.arange(n + 1), 0.8 * np.arange(m + 1)
    for i in range(1, n + 1):
        for j in range(1, m + 1):
            table[i, j] = min(table[i - 1, j - 1] + _cost(heard[i - 1], expected[j - 1][0]),
                              table[i - 1, j] + 0.8, table[i, j - 1] + 0.8)
    owners, i, j = [0] * n, n, m
    while i:
        if j and np.isclose(table[i, j], table[i - 1, j - 1] + _cost(heard[i - 1], expected[j - 1][0])):
            owners[i - 1], i, j = expected[j - 1][1], i - 1, j - 1
        elif np.isclose(table[i, j], table[i - 1, j] + 0.8):
            owners[i - 1], i = expected[max(j - 1, 0)][1] if expected else 0, i - 1
        else:
            j -= 1
    return owners, float(table[n, m])


def _cost(a: str, b: str) -> float:
    return 0.0 if a == b else 0.6 if (a in VOWELS) == (b in VOWELS) else 1.0
