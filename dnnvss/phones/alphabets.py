# ruff: noqa: RUF001  (signs of the phonetic alphabet look like others)
"""Phones in other alphabets: the International Phonetic Alphabet, X-SAMPA and ARPAbet, as phones of the lexicon."""

import re
import unicodedata

from dnnvss.errors import DnnvssError
from dnnvss.phones.inventory import SPOKEN, VOWELS, strip_stress

_IPA = {
    "iː": "IY", "i": "IY", "ɪ": "IH", "ɨ": "IH", "eɪ": "EY", "e": "EH", "ɛ": "EH", "æ": "AE", "a": "AE", "ɑː": "AA",
    "ɑ": "AA", "ɒ": "AA", "ɔː": "AO", "ɔ": "AO", "oʊ": "OW", "əʊ": "OW", "o": "OW", "ʊ": "UH", "uː": "UW", "u": "UW",
    "ʉ": "UW", "ʌ": "AH", "ə": "AH", "ɐ": "AH", "ɜː": "ER", "ɜ": "ER", "ɝ": "ER", "ɚ": "ER", "ɜɹ": "ER", "əɹ": "ER",
    "aɪ": "AY", "aʊ": "AW", "ɔɪ": "OY", "ɪə": "IH AH", "eə": "EH AH", "ɛə": "EH AH", "ʊə": "UH AH",
    "p": "P", "b": "B", "t": "T", "d": "D", "k": "K", "ɡ": "G", "g": "G", "f": "F", "v": "V", "θ": "TH", "ð": "DH",
    "s": "S", "z": "Z", "ʃ": "SH", "ʒ": "ZH", "h": "HH", "x": "K", "tʃ": "CH", "dʒ": "JH", "ʧ": "CH", "ʤ": "JH",
    "m": "M", "n": "N", "ŋ": "NG", "l": "L", "ɫ": "L", "ɹ": "R", "ɾ": "T", "ʔ": "T", "j": "Y", "w": "W",
    "ʍ": "W", "aj": "AY", "aw": "AW", "ej": "EY", "ɔj": "OY", "ow": "OW", "əw": "OW", "c": "K", "ɟ": "G",
    "ɲ": "N", "ɱ": "M", "ʎ": "L", "ʈ": "T", "ɖ": "D", "ɻ": "R", "ɕ": "SH", "ʑ": "ZH", "œ": "ER", "ʋ": "V", "χ": "K",
    "ᵻ": "IH", "ɵ": "UH", "ɘ": "AH", "ɜːɹ": "ER", "ai": "AY", "au": "AW", "ei": "EY", "ou": "OW", "oi": "OY",
    "ɔi": "OY", "ju": "Y UW", "juː": "Y UW", "ts": "T S", "dz": "D Z", "kp": "K P", "ɡb": "G B",
}
"""Sounds of English in the International Phonetic Alphabet, both varieties."""

_XSAMPA = {"r\\": "ɹ", "@`": "ɚ", "3`": "ɝ", "I": "ɪ", "E": "ɛ", "{": "æ", "A": "ɑ", "Q": "ɒ", "O": "ɔ", "U": "ʊ",
           "V": "ʌ", "@": "ə", "3": "ɜ", "T": "θ", "D": "ð", "S": "ʃ", "Z": "ʒ", "N": "ŋ", '"': "ˈ", "%": "ˌ", ":": "ː",
           "4": "ɾ", "?": "ʔ", "5": "ɫ", "W": "ʍ", "r": "ɹ"}
_IGNORED = re.compile(r"[\s.()|/\[\]\u00b7\u203f\u02b0\u02b2\u02b7\u02bc\u02e0\u02d1\u0300-\u036f-]")
"""Marks of length, aspiration, nasality, place and the like, with which a sound stays the phone that it is."""
_SYLLABIC = re.compile(r"(?<=[^\W\d_])([lmnŋɫɹr])(?:\u0329|=)")
"""A consonant that is a syllable, in a word; said with a vowel before it, as the lexicon writes it."""
_LONGEST = max(map(len, _IPA))


def arpabet(phones: str, alphabet: str = "ipa") -> tuple[str, ...]:
    """Phones as ARPAbet, vowels with their stress where some is told.

    Args:
        phones: as written.
        alphabet: ``ipa``, ``x-sampa`` or ``x-arpabet`` (``arpabet``, ``cmu``), with or without ``x-``.

    Raises:
        DnnvssError: another alphabet, or a sign that is no sound of English; names it.
    """
    kind = alphabet.lower().removeprefix("x-")
    if kind in ("arpabet", "cmu", "cmu-arpabet", "cmudict"):
        found = tuple(phones.upper().split())
        if bad := [p for p in found if strip_stress(p) not in SPOKEN]:
            raise DnnvssError(f"{bad[0]!r} is no phone of ARPAbet", remedy=f"Use {' '.join(SPOKEN)}")
        return found
    if kind == "sampa":
        phones = re.sub("|".join(map(re.escape, _XSAMPA)), lambda m: _XSAMPA[m[0]], phones)
    elif kind != "ipa":
        raise DnnvssError(f"the alphabet {alphabet!r} is not known", remedy="Use ipa, x-sampa or x-arpabet")
    return _spelt(_bare(_SYLLABIC.sub(r"ə\1", phones)), phones)


def single_sound(label: str, alphabet: str) -> tuple[str, ...]:
    """The phones of a label that stands for one sound: one, or two for a diphthong that the lexicon does not have.

    Args:
        label: as an aligner writes it.
        alphabet: ``ipa`` or ``x-sampa``.

    Raises:
        DnnvssError: it stands for none, or for several.
    """
    sign = re.sub("|".join(map(re.escape, _XSAMPA)), lambda m: _XSAMPA[m[0]], label) if alphabet == "x-sampa" else label
    bare = re.sub("[ˈˌ=]", "", _bare(sign))
    found = _IPA.get(bare) or _IPA.get(bare.rstrip("ː"))
    if found is None:
        raise DnnvssError(f"{label!r} is no sound of English that is known", remedy="Use ARPAbet")
    return tuple(found.split())


def _bare(phones: str) -> str:
    """Signs without the marks that change no phone, every r and every voiceless h written alike."""
    plain = unicodedata.normalize("NFC", phones).translate(str.maketrans("':rç", "ˈːɹh"))
    return _IGNORED.sub("", unicodedata.normalize("NFD", plain))


def _spelt(text: str, phones: str) -> tuple[str, ...]:
    """ARPAbet of signs of the International Phonetic Alphabet, the longest that fit first."""
    found: list[str] = []
    stress, told, at = "0", "ˈ" in text or "ˌ" in text, 0
    while at < len(text):
        if text[at] in "ˈˌ":
            stress, at = "1" if text[at] == "ˈ" else "2", at + 1
            continue
        size = next((k for k in range(_LONGEST, 0, -1) if text[at:at + k] in _IPA), 0)
        if not size and text[at] == "ː":
            at += 1
            continue
        if not size:
            raise DnnvssError(f"{text[at]!r} in {phones!r} is no sound of English that is known",
                              remedy="Write the phones of English in IPA, or as {T AH0 M EY1 T OW0}")
        for phone in _IPA[text[at:at + size]].split():
            vowel = phone in VOWELS
            found.append(phone + stress if vowel and told else phone)
            stress = "0" if vowel else stress
        at += size
    return tuple(found)
