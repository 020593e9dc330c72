# ruff: noqa: RUF001  (signs of the phonetic alphabet look like others)
"""Phones in the alphabets of other tools."""

import pytest

from dnnvss.phones.alphabets import arpabet, single_sound


@pytest.mark.parametrize(("written", "alphabet", "phones"), [
    ("ˈlɪtl̩", "ipa", "L IH1 T AH0 L"), ("\"lItl=", "x-sampa", "L IH1 T AH0 L"), ("ˈbʌtər", "ipa", "B AH1 T ER0"),
    ("bɜːrd", "ipa", "B ER D"), ("bɜːd", "ipa", "B ER D"), ("çjuːdʒ", "ipa", "HH Y UW JH"), ("lɒχ", "ipa", "L AA K"),
])
def test_words(written: str, alphabet: str, phones: str) -> None:
    assert " ".join(arpabet(written, alphabet)) == phones


@pytest.mark.parametrize(("label", "phones"), [
    ("ç", "HH"), ("t̪", "T"), ("d̪", "D"), ("ʋ", "V"), ("ɫ̩", "L"), ("juː", "Y UW"), ("ᵻ", "IH"), ("ɔj", "OY"),
])
def test_labels_of_the_montreal_forced_aligner_and_espeak(label: str, phones: str) -> None:
    assert " ".join(single_sound(label, "ipa")) == phones
