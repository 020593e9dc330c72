"""Syllables of a word by maximal onset."""

from collections.abc import Sequence
from itertools import pairwise

from dnnvss.phones import VOWELS, strip_stress

ONSETS = frozenset(
    tuple(onset.split())
    for onset in (
        # one consonant: all but NG
        "B", "CH", "D", "DH", "F", "G", "HH", "JH", "K", "L", "M", "N", "P", "R", "S", "SH", "T", "TH", "V", "W", "Y",
        "Z", "ZH",
        # stop or fricative before a liquid or glide
        "P L", "P R", "P Y", "B L", "B R", "B Y", "T R", "T W", "T Y", "D R", "D W", "D Y", "K L", "K R", "K W", "K Y",
        "G L", "G R", "G W", "G Y", "F L", "F R", "F Y", "V Y", "V R", "TH R", "TH W", "TH Y", "SH R", "SH W", "SH L",
        "SH M", "SH N", "HH Y", "HH W", "M Y", "N Y", "L Y", "S L", "S W", "S Y", "Z Y", "P W", "B W", "V W", "S R",
        # s before a consonant
        "S P", "S T", "S K", "S M", "S N", "S F", "S V",
        "S P L", "S P R", "S P Y", "S T R", "S T Y", "S K L", "S K R", "S K W", "S K Y", "S F R", "S M Y", "S N Y",
    )
)
"""Consonant clusters that may begin an English syllable; the empty onset is always legal."""


def syllable_starts(phones: Sequence[str]) -> list[int]:
    """Return the index at which each syllable of a word begins; the first is 0, and there is one syllable a vowel.

    Consonants between two vowels go to the later one as far as :data:`ONSETS` allows (maximal onset). A word without
    a vowel is one syllable; a word without phones has none.

    Args:
        phones: the phones of one word, with or without stress digits.
    """
    bare = [strip_stress(phone) for phone in phones]
    nuclei = [i for i, phone in enumerate(bare) if phone in VOWELS]
    starts = [0] if bare else []
    for left, right in pairwise(nuclei):
        start = left + 1
        while start < right and tuple(bare[start:right]) not in ONSETS:
            start += 1
        starts.append(start)
    return starts
