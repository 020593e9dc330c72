"""Words of alignments beside texts."""

import pytest

from dnnvss.text.agreement import OTHER, agreement


@pytest.mark.parametrize("text, words", [
    ("At noon, the child fixed this chair.", "at noon the child fixed this chair"),
    ("It's 25 degrees!", "it's twenty five degrees"), ("Dr. Smith can't", "doctor smith can't"),
    ("It is twenty-five past", "it is twenty five past"), ("Two words here", "two <unk> words here"),
    ("Don't stop", "don t stop"), ("Anything", "")])
def test_the_same_said_otherwise_agrees(text: str, words: str) -> None:
    assert agreement(text, words.split()).share == 1


def test_other_sentences_do_not_agree() -> None:
    other = agreement("Why did every judge find our azure book?", ("three", "sailors", "jumped", "around", "a"))
    assert other.share < OTHER
    near = agreement("At noon, the child fixed this chair.", ("at", "noon", "the", "boy", "fixed", "this", "chair"))
    assert near == (pytest.approx(6 / 7), "child", "boy")
