"""The phone set: the 39 phones of the CMU dictionary, silence and short pause."""

from dnnvss.errors import DnnvssError

SILENCE, SHORT_PAUSE = "sil", "sp"
SILENCES = (SILENCE, SHORT_PAUSE)

VOWELS = ("AA", "AE", "AH", "AO", "AW", "AY", "EH", "ER", "EY", "IH", "IY", "OW", "OY", "UH", "UW")
CONSONANTS = ("B", "CH", "D", "DH", "F", "G", "HH", "JH", "K", "L", "M", "N", "NG", "P", "R", "S", "SH", "T", "TH",
              "V", "W", "Y", "Z", "ZH")

SPOKEN = tuple(sorted(VOWELS + CONSONANTS))
PHONES = (*SPOKEN, SILENCE, SHORT_PAUSE)
"""All 41 labels; the position of a phone here is its code everywhere."""

_IDS = {phone: index for index, phone in enumerate(PHONES)}


def phone_id(phone: str) -> int:
    """Return the code of a phone, its position in :data:`PHONES`.

    Raises:
        DnnvssError: the label is not one of the 41.
    """
    try:
        return _IDS[phone]
    except KeyError:
        raise DnnvssError(f"unknown phone {phone!r}", remedy=f"Use one of: {' '.join(PHONES)}") from None


def strip_stress(phone: str) -> str:
    """Return the phone without its stress digit: ``AH0`` becomes ``AH``."""
    return phone.rstrip("012")
