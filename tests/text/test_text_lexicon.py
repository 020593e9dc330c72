"""Pronunciations: the dictionary, its variants, derivations, the network and stress."""

import pytest

from dnnvss.errors import DnnvssError
from dnnvss.phones import SPOKEN
from dnnvss.text.lexicon import LETTERS, entries, pronunciations
from dnnvss.text.network import SYMBOLS, spell, stress
from dnnvss.text.sentence import spoken_words


@pytest.mark.parametrize(("word", "variant", "phones"), [
    ("hello", "en_us", "HH AH L OW"),
    ("Z", "en_us", "Z IY"),
    ("z", "en_gb", "Z EH D"),
    ("w", "en_us", "D AH B AH L Y UW"),
    ("bath", "en_us", "B AE TH"),
    ("bath", "en_gb", "B AA TH"),
    ("baths", "en_gb", "B AA DH Z"),
    ("passing", "en_gb", "P AA S IH NG"),
    ("classes", "en_gb", "K L AA S AH Z"),
    ("gas", "en_gb", "G AE S"),
    ("can't", "en_gb", "K AA N T"),
    ("can\u2019t", "en_gb", "K AA N T"),
    ("tomato", "en_gb", "T AH M AA T OW"),
    ("schedule", "en_gb", "SH EH D Y UW L"),
    ("leisure", "en_gb", "L EH ZH ER"),
    ("new", "en_gb", "N Y UW"),
    ("tune", "en_gb", "T Y UW N"),
    ("noon", "en_gb", "N UW N"),
    ("analysed", "en_us", "AE N AH L AY Z D"),
    ("James's", "en_us", "JH EY M Z IH Z"),
    ("zeugma's", "en_us", None),
    ("café", "en_gb", "K AE F EY"),
])
def test_best_pronunciation(word: str, variant: str, phones: str | None) -> None:
    best = pronunciations(word, variant)[0]
    assert set(best) <= set(SPOKEN)
    assert phones is None or " ".join(best) == phones


def test_phones_given_in_a_text_are_the_pronunciation_of_their_word() -> None:
    words = [word for word, _ in spoken_words("the {W AY1 N D} {OY2} {S} well-known co-op B2")]
    assert words[1:4] == ["w-ay1-n-d", "oy2", "s"]
    assert [pronunciations(word)[0] for word in words[1:3]] == [("W", "AY", "N", "D"), ("OY",)]
    assert [entries(word)[0].source for word in [*words[3:], "s2", "x-ray"]].count("inline") == 0


def test_single_letters_have_their_names() -> None:
    assert all(LETTERS[c] in pronunciations(c) for c in "abcdefghijklmnopqrstuvwxyz")
    assert pronunciations("a") == [("AH",), ("EY",)]


def test_override_comes_first_and_is_checked() -> None:
    assert pronunciations("Wind", overrides={"wind": "W AY1 N D"}) == [("W", "AY", "N", "D")]
    with pytest.raises(DnnvssError, match=r"'wind' has unknown phones QQ"):
        pronunciations("wind", overrides={"wind": "W QQ"})


@pytest.mark.parametrize("word", ["—", "", "123", "日本"])
def test_a_word_without_letters_is_an_error(word: str) -> None:
    with pytest.raises(DnnvssError, match="no letter"):
        pronunciations(word)


def test_unknown_variant_is_an_error() -> None:
    with pytest.raises(DnnvssError, match="en_us, en_gb"):
        pronunciations("hello", "fr")


def test_sources_are_told() -> None:
    assert entries("hello")[0].source == "lexicon"
    assert entries("blorptastic")[0].source == "network" and "not in the lexicon" in entries("blorptastic")[0].doubt
    assert entries("xkcd")[0].phones == ("EH", "K", "S", "K", "EY", "S", "IY", "D", "IY")


def test_network_alphabet_is_the_checkpoints() -> None:
    assert len(SYMBOLS) == 74 and SYMBOLS[4] == "AA0" and SYMBOLS[-1] == "ZH" and SYMBOLS.index("UW0") == 66


def test_network_spells_and_stresses() -> None:
    assert spell("photograph")[0] == ("F", "OW1", "T", "AH0", "G", "R", "AE2", "F")
    assert stress("banana", ("B", "AH", "N", "AE", "N", "AH")) == ("B", "AH0", "N", "AE1", "N", "AH0")
    assert stress("cat", ("K", "AE", "T")) == ("K", "AE1", "T")
    assert stress("pst", ("P", "S", "T")) == ("P", "S", "T")
    assert sum(p.endswith("1") for p in stress("university", pronunciations("university")[0])) == 1


@pytest.mark.parametrize(("word", "phones"), [
    ("i'd've", "AY D AH V"), ("they'd've", "DH EY D AH V"), ("shouldn't've", "SH UH D AH N T AH V"),
    ("bob'll", "B AA B AH L"), ("sooo", "S OW"), ("whaaat", "W AH T"),
    ("cooool", "K UW L"), ("mmmm", "M"), ("psst", "P S T"), ("brrrr", "B ER"),
    ("megapixels", "M EH G AH P IH K S AH L Z"), ("kiloohms", "K IH L AH OW M Z"),
    ("autocorrect", "AO T OW K ER EH K T"),
])
def test_contractions_and_what_is_drawn_out(word: str, phones: str) -> None:
    assert " ".join(pronunciations(word)[0]) == phones
