"""How each phone is made and what of it is seen: one feature record a phone, from which every question derives."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Articulation:
    """The articulatory features of a phone.

    Args:
        manner: ``vowel``, ``stop``, ``nasal``, ``fricative``, ``affricate``, ``approximant`` or ``silence``.
        place: of consonants ``bilabial``, ``labiodental``, ``dental``, ``alveolar``, ``postalveolar``, ``palatal``,
            ``velar``, ``labiovelar`` or ``glottal``; of vowels ``front``, ``central`` or ``back`` (where they start).
        voiced: whether the vocal folds swing.
        height: of vowels ``high``, ``mid`` or ``low`` (where they start).
        opening: how far the jaw goes down, 0 (teeth together) to 1 (widest), as a speaker's neighbour would see it.
        lips: ``closed``, ``tucked`` (lower lip to upper teeth), ``rounded``, ``spread`` or ``neutral``.
        tense: of vowels, tense (long) or lax.
        glide: of diphthongs, where they go: ``front`` or ``rounded``.
        rhotic: an r-colour.
        lateral: air passes the sides of the tongue.
    """

    manner: str
    place: str
    voiced: bool = True
    height: str = ""
    opening: float = 0.3
    lips: str = "neutral"
    tense: bool = False
    glide: str = ""
    rhotic: bool = False
    lateral: bool = False


def _vowel(height: str, place: str, opening: float, lips: str = "neutral", tense: bool = False, glide: str = "",
           rhotic: bool = False) -> Articulation:
    return Articulation("vowel", place, True, height, opening, lips, tense, glide, rhotic)


def _consonant(manner: str, place: str, voiced: bool, opening: float, lips: str = "neutral") -> Articulation:
    return Articulation(manner, place, voiced, opening=opening, lips=lips)


ARTICULATION: dict[str, Articulation] = {
    "AA": _vowel("low", "back", 1.0, tense=True),
    "AE": _vowel("low", "front", 0.9, "spread"),
    "AH": _vowel("mid", "central", 0.5),
    "AO": _vowel("mid", "back", 0.8, "rounded", tense=True),
    "AW": _vowel("low", "central", 0.9, tense=True, glide="rounded"),
    "AY": _vowel("low", "central", 0.9, tense=True, glide="front"),
    "EH": _vowel("mid", "front", 0.6),
    "ER": _vowel("mid", "central", 0.4, "rounded", tense=True, rhotic=True),
    "EY": _vowel("mid", "front", 0.5, "spread", tense=True, glide="front"),
    "IH": _vowel("high", "front", 0.4, "spread"),
    "IY": _vowel("high", "front", 0.3, "spread", tense=True),
    "OW": _vowel("mid", "back", 0.6, "rounded", tense=True, glide="rounded"),
    "OY": _vowel("mid", "back", 0.7, "rounded", tense=True, glide="front"),
    "UH": _vowel("high", "back", 0.4, "rounded"),
    "UW": _vowel("high", "back", 0.3, "rounded", tense=True),
    "P": _consonant("stop", "bilabial", False, 0.1, "closed"),
    "B": _consonant("stop", "bilabial", True, 0.1, "closed"),
    "M": _consonant("nasal", "bilabial", True, 0.1, "closed"),
    "F": _consonant("fricative", "labiodental", False, 0.2, "tucked"),
    "V": _consonant("fricative", "labiodental", True, 0.2, "tucked"),
    "TH": _consonant("fricative", "dental", False, 0.3),
    "DH": _consonant("fricative", "dental", True, 0.3),
    "T": _consonant("stop", "alveolar", False, 0.2),
    "D": _consonant("stop", "alveolar", True, 0.2),
    "S": _consonant("fricative", "alveolar", False, 0.1),
    "Z": _consonant("fricative", "alveolar", True, 0.1),
    "N": _consonant("nasal", "alveolar", True, 0.3),
    "L": Articulation("approximant", "alveolar", opening=0.4, lateral=True),
    "SH": _consonant("fricative", "postalveolar", False, 0.1, "rounded"),
    "ZH": _consonant("fricative", "postalveolar", True, 0.1, "rounded"),
    "CH": _consonant("affricate", "postalveolar", False, 0.1, "rounded"),
    "JH": _consonant("affricate", "postalveolar", True, 0.1, "rounded"),
    "R": Articulation("approximant", "postalveolar", opening=0.3, lips="rounded", rhotic=True),
    "Y": _consonant("approximant", "palatal", True, 0.3, "spread"),
    "W": _consonant("approximant", "labiovelar", True, 0.2, "rounded"),
    "K": _consonant("stop", "velar", False, 0.4),
    "G": _consonant("stop", "velar", True, 0.4),
    "NG": _consonant("nasal", "velar", True, 0.4),
    "HH": _consonant("fricative", "glottal", False, 0.5),
    "sil": _consonant("silence", "", False, 0.0),
    "sp": _consonant("silence", "short", False, 0.0),
}

BILABIALS = tuple(phone for phone, made in ARTICULATION.items() if made.place == "bilabial")
"""P, B and M: the lips close."""

LABIODENTALS = tuple(phone for phone, made in ARTICULATION.items() if made.place == "labiodental")
"""F and V: the lower lip touches the upper teeth."""
