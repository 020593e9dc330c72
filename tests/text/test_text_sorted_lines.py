"""The lexicon, looked up where it lies, against a table of it."""

import random

import pytest

from dnnvss.text import sorted_lines
from dnnvss.text.lexicon import dictionary
from dnnvss.text.sorted_lines import SortedLines

SMALL = "a AH\na(2) EY\na's EY Z\nab AE B\nabc EY B IY S IY\n"


def test_a_few_lines_by_hand() -> None:
    table = SortedLines(SMALL)
    assert table["a"] == "AH" and table["a(2)"] == "EY" and table["abc"] == "EY B IY S IY" and len(table) == 5
    for absent in ("", "a(3)", "aa", "z", "0", "a'", "(", "a(2"):
        assert absent not in table and table.get(absent) is None


@pytest.mark.parametrize("many", [0, 10**9])
def test_every_word_of_the_lexicon_is_found_either_way(many: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sorted_lines, "MANY", many)
    text = dictionary()._text  # type: ignore[attr-defined]
    whole = dict(line.split(" ", 1) for line in text.splitlines())
    table, words = SortedLines(text), list(whole)
    assert list(table) == words and len(table) > 130_000
    for word in (*random.Random(0).sample(words, 3000), words[0], words[-1]):
        assert table[word] == whole[word]
        assert ((word + "q") in table) == ((word + "q") in whole)
