"""Pronunciations of words: the CMU dictionary, variants of English before it, regular derivations, and a network last.

The dictionary is the one inside the pocketsphinx wheel (BSD licence, 134,000 entries, no stress digits). Stress comes
from :func:`dnnvss.text.network.stress`.
"""

import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.phones import SPOKEN, VOWELS, strip_stress
from dnnvss.text import derive, network
from dnnvss.text.sorted_lines import SortedLines
from dnnvss.text.variants import VARIANTS, british

Phones = tuple[str, ...]
Overrides = Mapping[str, "str | Sequence[str]"]

LETTERS: dict[str, Phones] = {
    letter: tuple(phones.split())
    for letter, phones in {
        "a": "EY", "b": "B IY", "c": "S IY", "d": "D IY", "e": "IY", "f": "EH F", "g": "JH IY", "h": "EY CH",
        "i": "AY", "j": "JH EY", "k": "K EY", "l": "EH L", "m": "EH M", "n": "EH N", "o": "OW", "p": "P IY",
        "q": "K Y UW", "r": "AA R", "s": "EH S", "t": "T IY", "u": "Y UW", "v": "V IY",
        "w": "D AH B AH L Y UW", "x": "EH K S", "y": "W AY", "z": "Z IY",
    }.items()
}
"""The names of the letters (American; in ``en_gb`` z is ``Z EH D``)."""


_MARGIN = 0.2
"""Log-probability a symbol that a compound may lose to the network's own spelling (best on 900 lexicon words)."""


_NOISES: dict[str, Phones] = {
    word: tuple(phones.split()) for word, phones in {
        "psst": "P S T", "pst": "P S T", "tsk": "T S K", "brr": "B ER", "grr": "G ER", "pfft": "F T", "hm": "HH M",
        "nth": "EH N TH", "sh": "SH", "zz": "Z"}.items()}
"""What is written without a vowel and said, not spelt."""


class Entry(NamedTuple):
    """A pronunciation without stress digits, where it came from, and what is doubtful about it (empty if nothing)."""

    phones: Phones
    source: str
    doubt: str = ""


@lru_cache(maxsize=1)
def dictionary() -> Mapping[str, str]:
    """Return the CMU dictionary: word (or ``word(2)`` for a second pronunciation) to phones, both as written there.

    Raises:
        DnnvssError: pocketsphinx is not installed or its dictionary is damaged.
    """
    remedy = "Install the package again: pip install 'pocketsphinx>=5.0.4'"
    spec = find_spec("pocketsphinx")
    if spec is None or not spec.submodule_search_locations:
        raise DnnvssError("the package pocketsphinx, which holds the lexicon, is not installed", remedy=remedy)
    path = Path(spec.submodule_search_locations[0]) / "model" / "en-us" / "cmudict-en-us.dict"
    return SortedLines(files.read(path, lambda p: p.read_text(encoding="utf-8"), remedy))


def looked_up(word: str) -> list[Phones]:
    """Return the dictionary's pronunciations of a word in its order, which is roughly by frequency; none if absent."""
    table, found = dictionary(), []
    key, number = word, 1
    while key in table:
        found.append(tuple(table[key].split()))
        number += 1
        key = f"{word}({number})"
    return found


def letter_name(letter: str, variant: str = "en_us") -> Phones:
    """Return the phones of a letter's name."""
    return ("Z", "EH", "D") if letter == "z" and variant == "en_gb" else LETTERS[letter]


def entries(word: str, variant: str = "en_us", overrides: Overrides | None = None) -> list[Entry]:
    """Return the pronunciations of a word with their sources, best first, never none.

    In order: phones given in the text (:func:`given_phones`), the user's overrides, names of single letters, the
    variant's table, the dictionary, words derived from it (possessive, inflection, British spelling, compound), the
    network.

    Raises:
        DnnvssError: an unknown variant, a word without letters, or an override that is not made of the 39 phones.
    """
    if variant not in VARIANTS:
        raise DnnvssError(f"unknown variant {variant!r}", remedy=f"Use one of: {', '.join(VARIANTS)}")
    if given := given_phones(word):
        return [Entry(tuple(map(strip_stress, given)), "inline")]
    key = word.lower() if word.lower() in dictionary() else normalised(word)
    if own := _override(key, overrides):
        return [Entry(own, "override")]
    return list(_entries(key, variant))


def pronunciations(word: str, variant: str = "en_us", overrides: Overrides | None = None) -> list[Phones]:
    """Return the pronunciations of a word, best first, never none; phones of the 39, without stress digits.

    Args:
        word: one word as written, upper or lower case.
        variant: ``"en_us"`` or ``"en_gb"``.
        overrides: word in lower case to phones (``"W AY N D"`` or a sequence); stress digits are allowed.

    Raises:
        DnnvssError: an unknown variant, a word without letters, or an override that is not made of the 39 phones.
    """
    return list(dict.fromkeys(entry.phones for entry in entries(word, variant, overrides)))


def name_of(phones: Sequence[str]) -> str:
    """Return the word that stands for phones given in a text: ``w-ay1-n-d``."""
    return "-".join(p.lower() for p in phones)


def given_phones(word: str) -> Phones:
    """Return the phones, with their stress digits, that a word made by :func:`name_of` stands for; none for others.

    A single phone is known by its stress digit only: without one it looks like a word or a letter.
    """
    phones = tuple(word.upper().split("-"))
    single = len(phones) == 1 and (strip_stress(word) == word or strip_stress(phones[0]) not in VOWELS)
    return phones if not single and all(strip_stress(p) in SPOKEN for p in phones) else ()


def normalised(word: str) -> str:
    """Return the word in lower case, its apostrophes straight and its accents removed.

    Raises:
        DnnvssError: nothing is left that has a letter of the Latin alphabet.
    """
    key = derive.plain(word)
    if not any("a" <= letter <= "z" for letter in key):
        raise DnnvssError(f"the word {word!r} has no letter that English can speak",
                          remedy="Write it in Latin letters or give its phones in braces, e.g. {W AY1 N D}")
    return key


def check_phones(phones: "str | Sequence[str]", word: str) -> Phones:
    """Return phones as a tuple with their stress digits.

    Raises:
        DnnvssError: one of them is not among the 39, naming it and the word.
    """
    parts = tuple(phones.upper().split()) if isinstance(phones, str) else tuple(phones)
    bad = [p for p in parts if strip_stress(p) not in SPOKEN]
    if bad or not parts:
        what = f"unknown phones {' '.join(bad)}" if bad else "no phone"
        raise DnnvssError(f"the pronunciation of {word!r} has {what}",
                          remedy=f"Use ARPAbet: {' '.join(SPOKEN)}, vowels with stress 0, 1 or 2 if known")
    return parts


def _override(key: str, overrides: Overrides | None) -> Phones:
    if not overrides or key not in overrides:
        return ()
    return tuple(strip_stress(p) for p in check_phones(overrides[key], key))


@lru_cache(maxsize=16384)
def _entries(key: str, variant: str) -> tuple[Entry, ...]:
    if len(key) == 1 and key != "a":
        return (Entry(letter_name(key, variant), "letter"),)
    listed = [Entry(phones, "lexicon") for phones in looked_up(key)]
    if variant == "en_gb":
        listed = [*(Entry(p, source) for p, source in british(key, [e.phones for e in listed], looked_up)), *listed]
    if listed:
        return tuple(listed)
    derived = derive.derived(key, lambda base: [e.phones for e in _entries(base, variant)] if _known(base) else [],
                             _plausible)
    if derived:
        return tuple(Entry(phones, source) for phones, source in derived)
    return (_guessed(key, variant),)


def _plausible(key: str, phones: Phones) -> bool:
    """Return whether the network, asked to spell these phones, finds them about as likely as its own."""
    letters = "".join(c for c in key if "a" <= c <= "z")
    return network.likelihood(letters, phones) > network.spell(letters)[1] - _MARGIN


def _known(key: str) -> bool:
    return key in dictionary()


def _guessed(key: str, variant: str) -> Entry:
    letters = "".join(c for c in key if "a" <= c <= "z")
    if noise := _NOISES.get(re.sub(r"(.)\1{2,}", r"\1\1", letters)):
        return Entry(noise, "lexicon (noise)")
    if not set(letters) & set("aeiouy"):
        return Entry(tuple(p for c in letters for p in letter_name(c, variant)), "letters", "no vowel: spelt out")
    phones, score = network.spell(letters)
    bare = tuple(strip_stress(p) for p in phones)
    bare = bare[:-1] if bare[-1:] == ("HH",) else bare  # no word of English ends in it
    if not bare:
        return Entry(tuple(p for c in letters for p in letter_name(c, variant)), "letters", "not readable: spelt out")
    return Entry(bare, "network", f"not in the lexicon (log-probability {score:.2f} a phone)")
