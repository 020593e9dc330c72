"""What the formant voice knows of each phone: formants, voicing and noise.

Formants are textbook averages of male American English (vowels after Hillenbrand et al., J. Acoust. Soc. Am. 97(5),
1995; consonant loci after Delattre, Liberman and Cooper, J. Acoust. Soc. Am. 27(4), 1955), rounded by hand and tuned
until a speech recogniser heard the words.
"""

from typing import NamedTuple

from dnnvss.errors import DnnvssError
from dnnvss.phones import SPOKEN

Formants = tuple[float, float, float]


class Sound(NamedTuple):
    """How a phone is made.

    Args:
        kind: vowel, glide, nasal, stop, affricate, fricative or aspirate.
        start, end: formants F1 to F3 in Hz at the beginning and end of its steady part.
        pull: share of the neighbouring vowel's F2 in this consonant's F2 (slope of its locus equation).
        voice: amplitude of voicing (a vowel is 1).
        noise: name of the noise in :data:`NOISES`, or ``""``.
        hiss: amplitude of the noise.
        zero: frequency in Hz of the nasal's antiformant, 0 for sounds that are not nasal.
    """

    kind: str
    start: Formants
    end: Formants
    pull: float
    voice: float
    noise: str = ""
    hiss: float = 0.0
    zero: float = 0.0


NOISES: dict[str, tuple[tuple[float, float, float], ...]] = {
    "labial": ((1400, 1500, 0.25), (6800, 4000, 0.5)),
    "dental": ((1500, 1500, 0.15), (6200, 3000, 0.6)),
    "alveolar": ((4600, 900, 0.6), (6200, 1400, 1.0)),
    "postalveolar": ((2600, 500, 0.9), (3600, 900, 0.6), (5200, 1500, 0.25)),
    "burst-labial": ((700, 900, 1.0), (1600, 1500, 0.4)),
    "burst-alveolar": ((3900, 1000, 1.0), (5200, 1500, 0.6)),
    "burst-velar": ((1600, 400, 1.0), (3600, 1200, 0.25)),
    "burst-palatal": ((2500, 500, 1.0), (4200, 1200, 0.3)),
}
"""Spectra of noise: bands as (centre in Hz, width in Hz, gain)."""


def _vowel(start: Formants, end: Formants | None = None) -> Sound:
    return Sound("vowel", start, end or start, 1.0, 1.0)


def _consonant(kind: str, f: Formants, pull: float, voice: float, noise: str = "", hiss: float = 0.0,
               zero: float = 0.0) -> Sound:
    return Sound(kind, f, f, pull, voice, noise, hiss, zero)


_LABIAL, _DENTAL, _ALVEOLAR, _PALATAL, _VELAR = (
    (220.0, 850.0, 2250.0), (250.0, 1350.0, 2550.0), (220.0, 1750.0, 2650.0), (240.0, 1900.0, 2450.0),
    (220.0, 1900.0, 2200.0),
)

SOUNDS: dict[str, Sound] = {
    "IY": _vowel((290, 2270, 3000)), "IH": _vowel((420, 1980, 2570)), "EH": _vowel((570, 1810, 2520)),
    "AE": _vowel((690, 1680, 2430)), "AA": _vowel((740, 1150, 2480)), "AO": _vowel((600, 900, 2520)),
    "AH": _vowel((600, 1240, 2520)), "UH": _vowel((450, 1080, 2350)), "UW": _vowel((320, 960, 2300)),
    "ER": _vowel((470, 1320, 1680)),
    "EY": _vowel((490, 1930, 2560), (330, 2240, 2800)), "AY": _vowel((740, 1230, 2450), (370, 2050, 2650)),
    "OY": _vowel((560, 880, 2450), (370, 2000, 2600)), "AW": _vowel((740, 1320, 2450), (410, 930, 2350)),
    "OW": _vowel((530, 1020, 2400), (370, 850, 2300)),
    "W": _consonant("glide", (300, 640, 2200), 0.1, 0.75), "Y": _consonant("glide", (270, 2280, 3050), 0.1, 0.75),
    "L": _consonant("glide", (370, 1050, 2800), 0.25, 0.7), "R": _consonant("glide", (370, 1150, 1580), 0.15, 0.75),
    "M": _consonant("nasal", (400, 1000, 2150), 0.6, 0.6, zero=460),
    "N": _consonant("nasal", (400, 1600, 2550), 0.35, 0.6, zero=480),
    "NG": _consonant("nasal", (400, 1950, 2350), 0.7, 0.6, zero=500),
    "P": _consonant("stop", _LABIAL, 0.7, 0.0, "burst-labial", 0.5),
    "B": _consonant("stop", _LABIAL, 0.75, 0.16, "burst-labial", 0.35),
    "T": _consonant("stop", _ALVEOLAR, 0.4, 0.0, "burst-alveolar", 0.6),
    "D": _consonant("stop", _ALVEOLAR, 0.45, 0.16, "burst-alveolar", 0.4),
    "K": _consonant("stop", _VELAR, 0.85, 0.0, "burst-velar", 0.6),
    "G": _consonant("stop", _VELAR, 0.85, 0.16, "burst-velar", 0.45),
    "CH": _consonant("affricate", _PALATAL, 0.3, 0.0, "postalveolar", 0.5),
    "JH": _consonant("affricate", _PALATAL, 0.3, 0.2, "postalveolar", 0.3),
    "F": _consonant("fricative", (230, 1000, 2200), 0.65, 0.0, "labial", 0.16),
    "V": _consonant("fricative", (230, 1000, 2200), 0.65, 0.4, "labial", 0.08),
    "TH": _consonant("fricative", _DENTAL, 0.45, 0.0, "dental", 0.12),
    "DH": _consonant("fricative", _DENTAL, 0.45, 0.45, "dental", 0.05),
    "S": _consonant("fricative", _ALVEOLAR, 0.35, 0.0, "alveolar", 0.5),
    "Z": _consonant("fricative", _ALVEOLAR, 0.35, 0.35, "alveolar", 0.25),
    "SH": _consonant("fricative", _PALATAL, 0.3, 0.0, "postalveolar", 0.5),
    "ZH": _consonant("fricative", _PALATAL, 0.3, 0.35, "postalveolar", 0.25),
    "HH": _consonant("aspirate", (500, 1450, 2500), 1.0, 0.0),
}
"""All 39 phones."""


def sound(phone: str) -> Sound:
    """Return how a phone is made.

    Raises:
        DnnvssError: the phone is not one of the 39.
    """
    try:
        return SOUNDS[phone]
    except KeyError:
        raise DnnvssError(f"unknown phone {phone!r}", remedy=f"Use one of: {' '.join(SPOKEN)} sil sp") from None
