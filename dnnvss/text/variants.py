"""British pronunciations: a table of words, lists of words by vowel, and the glide in *new* and *tune*.

R is kept after vowels: the phone set and the dictionary are rhotic, and lips do not tell.
"""

import re
from collections.abc import Callable
from functools import lru_cache
from importlib.resources import files as package_files

VARIANTS = ("en_us", "en_gb")
Phones = tuple[str, ...]

_ENDINGS = ("'s", "s'", "es", "ed", "ing", "ers", "er", "ly", "d", "s")


@lru_cache(maxsize=4)
def _lines(name: str) -> tuple[str, ...]:
    text = (package_files("dnnvss.text") / "data" / name).read_text(encoding="utf-8")
    return tuple(line for line in text.splitlines() if line and not line.startswith("#"))


@lru_cache(maxsize=1)
def _table() -> dict[str, tuple[Phones, ...]]:
    rows = (line.split("\t") for line in _lines("en_gb.tsv"))
    return {word: tuple(tuple(p.split()) for p in prons.split(",")) for word, prons in rows}


@lru_cache(maxsize=2)
def _listed(name: str) -> frozenset[str]:
    return frozenset(" ".join(_lines(name)).split())


def _in(words: frozenset[str], key: str) -> bool:
    """True if a word, or what is left of it without a regular ending, is in the list."""
    if key in words:
        return True
    stems = (key[: -len(e)] for e in _ENDINGS if key.endswith(e))
    return any(s in words or s + "e" in words or (s[-1:] == s[-2:-1] and s[:-1] in words) for s in stems)


def british(key: str, american: list[Phones], lookup: Callable[[str], list[Phones]]) -> list[tuple[Phones, str]]:
    """Return the British pronunciations of a word that differ from the first American one, each with its source.

    Args:
        key: the word in lower case.
        american: its pronunciations in the dictionary, best first; may be empty.
        lookup: the dictionary, for the stems of inflected words.
    """
    if key in _table():
        return [(phones, "en_gb table") for phones in _table()[key]]
    if key.endswith("'s") and key[:-2] in _table():
        return [(p + (("IH", "Z") if p[-1] in ("S", "Z", "SH", "ZH", "CH", "JH")
                       else ("S",) if p[-1] in ("P", "T", "K", "F", "TH") else ("Z",)), "en_gb table")
                for p in _table()[key[:-2]]]
    if not american:
        return []
    first = american[0]
    changed = _glided(key, american, _vowelled(key, first))
    if key.endswith(("isation", "ization", "isations", "izations")):
        changed = tuple(" ".join(changed).replace("AH Z EY SH AH N", "AY Z EY SH AH N").split())
    return [(changed, "en_gb rule")] if changed != first else []


def _vowelled(key: str, phones: Phones) -> Phones:
    """Return the phones with the broad a of *bath* and the short o of *dog* where the word is in their lists."""
    if _in(_listed("en_gb_bath.txt"), key) and "AE" in phones:
        at = phones.index("AE")
        return (*phones[:at], "AA", *phones[at + 1 :])
    if _in(_listed("en_gb_lot.txt"), key):
        return tuple("AA" if p == "AO" else p for p in phones)
    return phones


def _glided(key: str, american: list[Phones], phones: Phones) -> Phones:
    """Return the phones with Y between T, D or N and the UW that is written u, ew or eu."""
    for other in american[1:]:
        if len(other) == len(phones) + 1 and _without_glide(other) == phones:
            return other
    if len(re.findall(r"(?<=[tdn])(?:ew|eu|u(?![iy]))", key)) != 1 or re.search(r"[tdn]oo", key):
        return phones
    out: list[str] = []
    for previous, phone in zip((None, *phones), phones, strict=False):
        if phone == "UW" and previous in ("T", "D", "N"):
            out.append("Y")
        out.append(phone)
    return tuple(out)


def _without_glide(phones: Phones) -> Phones:
    return tuple(p for i, p in enumerate(phones)
                 if not (p == "Y" and i and phones[i - 1] in ("T", "D", "N") and phones[i + 1 : i + 2] == ("UW",)))
