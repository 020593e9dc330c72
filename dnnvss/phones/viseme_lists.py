"""Visemes of other programs: which of them shows each phone.

**Source.** Meta, "Viseme reference" of Oculus Lipsync; D. Wolf, "Rhubarb Lip Sync", README, mouth shapes; Microsoft,
"Map phonemes to viseme IDs" of Azure's speech service. Diphthongs have two, each half of the phone's time, where the
list has none of its own for them.
"""

from collections.abc import Mapping

from dnnvss.phones.inventory import PHONES, SILENCES

_OCULUS = {
    "PP": "P B M", "FF": "F V", "TH": "TH DH", "DD": "T D", "kk": "K G NG HH", "CH": "CH JH SH ZH", "SS": "S Z",
    "nn": "N L", "RR": "R ER", "aa": "AA AE AH", "E": "EH", "ih": "IH IY Y", "oh": "AO", "ou": "UH UW W",
    "aa ih": "AY", "aa ou": "AW", "E ih": "EY", "oh ou": "OW", "oh ih": "OY"}  # fmt: skip
_RHUBARB = {
    "A": "P B M", "B": "K S T D G N NG Z TH DH CH JH SH ZH R Y HH IY IH", "C": "EH AE AH", "D": "AA",
    "E": "AO ER UH", "F": "UW W", "G": "F V", "H": "L",
    "D B": "AY", "D F": "AW", "C B": "EY", "E F": "OW", "E B": "OY"}  # fmt: skip
_AZURE = {
    "1": "AE AH", "2": "AA", "3": "AO", "4": "EH UH", "5": "ER", "6": "Y IY IH", "7": "W UW", "8": "OW", "9": "AW",
    "10": "OY", "11": "AY", "12": "HH", "13": "R", "14": "L", "15": "S Z", "16": "SH CH JH ZH", "17": "DH",
    "18": "F V", "19": "D T N TH", "20": "K G NG", "21": "P B M", "4 6": "EY"}  # fmt: skip
_SILENCE = {"oculus": "sil", "rhubarb": "X", "azure": "0"}


def _table(lists: Mapping[str, str], silence: str) -> dict[str, tuple[str, ...]]:
    made = {
        phone: tuple(visemes.split())
        for visemes, phones in lists.items()
        for phone in phones.split()
    }
    return made | dict.fromkeys(SILENCES, (silence,))


VISEMES = {
    name: _table(lists, _SILENCE[name])
    for name, lists in (("oculus", _OCULUS), ("rhubarb", _RHUBARB), ("azure", _AZURE))
}
"""Name of a list to phone to its visemes, one after the other."""
OCULUS = ("sil", "PP", "FF", "TH", "DD", "kk", "CH", "SS", "nn", "RR", "aa", "E", "ih", "oh", "ou")
"""The 15 visemes of Oculus Lipsync in its order."""

assert all(set(table) == set(PHONES) for table in VISEMES.values())
