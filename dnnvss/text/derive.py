"""Words that follow from words of the lexicon: possessives, inflections, British spellings, compounds."""

import re
import unicodedata
from collections.abc import Callable, Iterator

from dnnvss.phones.inventory import VOWELS

Phones = tuple[str, ...]
Lookup = Callable[[str], list[Phones]]

_VOICELESS = frozenset(["P", "T", "K", "F", "TH"])
_SIBILANTS = frozenset(["S", "Z", "SH", "ZH", "CH", "JH"])

_RESPELT = (
    (r"our(?=$|s$|ed$|ing$|er|able|ful|ist|ite|less|hood)", "or"),
    (r"is(?=e$|es$|ed$|er$|ers$|ing$|ation$|ations$|able$)", "iz"),
    (r"ys(?=e$|es$|ed$|er$|ers$|ing$)", "yz"),
    (r"([^aeiou])re(?=$|s$|d$)", r"\1er"),
    (r"ll(?=ed$|ing$|er$|ers$|ery$|or$|ors$)", "l"),
    (r"ogue(?=$|s$)", "og"),
    (r"mme(?=$|s$)", "m"),
    (r"ence(?=$|s$|less$)", "ense"),
    (r"^oe(?=[sd])|(?<=[hnpidr])ae(?=[mdso])|(?<=[fhn])oe(?=[tmua]|$)", "e"),
    (r"lful$", "llful"),
    (r"llery$", "lry"),
    (r"^pyj", "paj"),
    (r"sceptic", "skeptic"),
    (r"plough", "plow"),
    (r"grey", "gray"),
    (r"tyre", "tire"),
    (r"mould", "mold"),
)

_CLITIC = re.compile(r"(?:'ve|'ll|'d|'re|'m|n't)$")
_DRAWN = re.compile(r"(.)\1{2,}")

_LONG = 12  # letters from which two words in a row are hardly chance

_LIGATURES = str.maketrans({"æ": "ae", "œ": "oe", "ø": "o", "ß": "ss", "ł": "l", "đ": "d", "ð": "th", "þ": "th",
                            "\u0131": "i", "ħ": "h", "ŧ": "t", "ŋ": "ng", "ĸ": "k"})

_SUFFIXES: tuple[tuple[str, Phones], ...] = (
    ("ly", ("L", "IY")), ("ness", ("N", "AH", "S")), ("less", ("L", "AH", "S")), ("ful", ("F", "AH", "L")),
    ("ment", ("M", "AH", "N", "T")), ("ship", ("SH", "IH", "P")), ("like", ("L", "AY", "K")),
)
_PREFIXES: tuple[tuple[str, Phones], ...] = (
    ("un", ("AH", "N")), ("non", ("N", "AA", "N")), ("re", ("R", "IY")), ("over", ("OW", "V", "ER")),
    ("under", ("AH", "N", "D", "ER")), ("mis", ("M", "IH", "S")), ("anti", ("AE", "N", "T", "IY")),
    ("super", ("S", "UW", "P", "ER")), ("micro", ("M", "AY", "K", "R", "OW")), ("multi", ("M", "AH", "L", "T", "IY")),
    ("inter", ("IH", "N", "T", "ER")), ("pre", ("P", "R", "IY")), ("semi", ("S", "EH", "M", "IY")),
    ("auto", ("AO", "T", "OW")), ("nano", ("N", "AE", "N", "OW")), ("milli", ("M", "IH", "L", "AH")),
    ("centi", ("S", "EH", "N", "T", "AH")), ("deci", ("D", "EH", "S", "IH")), ("hecto", ("HH", "EH", "K", "T", "OW")),
    ("kilo", ("K", "IH", "L", "AH")), ("mega", ("M", "EH", "G", "AH")), ("giga", ("G", "IH", "G", "AH")),
    ("tera", ("T", "EH", "R", "AH")), ("peta", ("P", "EH", "T", "AH")),
)


def plain(word: str) -> str:
    """Return the word in lower case, accents and ligatures taken apart, apostrophes straight, other signs removed."""
    word = word.replace("\u2019", "'").replace("\u02bc", "'").lower()
    taken_apart = unicodedata.normalize("NFKD", word.translate(_LIGATURES))
    return "".join(c for c in taken_apart if "a" <= c <= "z" or c == "'")


def derived(key: str, lookup: Lookup, plausible: Callable[[str, Phones], bool]) -> list[tuple[Phones, str]]:
    """Return pronunciations of a word that is not in the lexicon, made from ones that are, each with its derivation.

    Args:
        key: the word as :func:`plain` gives it.
        lookup: lexicon word to pronunciations, none where it is absent.
        plausible: whether a word may have these phones; asked of compounds, many of which are chance (*Hartman* is no
            *hart* and *man*).
    """
    for rule in (_possessive, _contracted, _drawn_out, _inflected, _respelt, _affixed, _compound):
        for phones, base in rule(key, lookup):
            if rule is not _compound or len(key) >= _LONG or plausible(key, phones):
                return [(phones, f"lexicon ({base})")]
    return []


def _possessive(key: str, lookup: Lookup) -> Iterator[tuple[Phones, str]]:
    if key.endswith("'s") or key.endswith("s'"):
        base = key[:-2] if key.endswith("'s") else key[:-1]
        known = lookup(base) or [p for p, _ in _inflected(base, lookup)]
        for phones in known:
            yield (phones if key.endswith("s'") else (*phones, *_s(phones))), f"{base} + {key[len(base):]}"
    elif "'" in key and not _CLITIC.search(key) and (known := lookup(key.replace("'", ""))):
        yield known[0], key.replace("'", "")


def _contracted(key: str, lookup: Lookup) -> Iterator[tuple[Phones, str]]:
    """A word with what is left of *have*, *will*, *would*, *are*, *am* or *not* behind it, several times if need be."""
    match = _CLITIC.search(key)
    if match is None or not match.start():
        return
    base, ending = key[: match.start()], match[0]
    for phones in lookup(base)[:1] or [p for p, _ in _contracted(base, lookup)][:1]:
        after_vowel, voiced = phones[-1] in VOWELS, phones[-1] in VOWELS or phones[-1] in ("L", "M", "N", "R")
        sound = {"'ve": ("V",) if after_vowel else ("AH", "V"), "'ll": ("L",) if after_vowel else ("AH", "L"),
                 "'d": ("D",) if voiced else ("AH", "D"), "'re": ("ER",), "'m": ("M",),
                 "n't": ("AH", "N", "T")}[ending]
        yield phones + sound, f"{base} + {ending}"


def _drawn_out(key: str, lookup: Lookup) -> Iterator[tuple[Phones, str]]:
    """A word with a letter three times or more (*sooo*, *whaaat*): meant once at its end, elsewhere twice or once."""
    if not _DRAWN.search(key):
        return
    ends, twice = re.sub(r"(.)\1{2,}$", r"\1", key), _DRAWN.sub(r"\1\1", key)
    for base in (_DRAWN.sub(r"\1\1", ends), _DRAWN.sub(r"\1", ends), twice) if set(key) & set("aeiouy") else (twice,):
        for phones in lookup(base)[:1]:
            yield phones, base


def _respelt(key: str, lookup: Lookup) -> Iterator[tuple[Phones, str]]:
    each = [re.sub(pattern, replacement, key) for pattern, replacement in _RESPELT]
    together = key
    for pattern, replacement in _RESPELT:
        together = re.sub(pattern, replacement, together)
    for american in dict.fromkeys([*each, together]):
        if american == key:
            continue
        if known := lookup(american):
            yield known[0], f"spelt {american}"
        for phones, base in _inflected(american, lookup):
            yield phones, f"spelt {base}"


def plural(phones: Phones) -> Phones:
    """Return phones with the ending -s of plurals, possessives and verbs, without stress."""
    return phones + _s(phones)


def past(phones: Phones) -> Phones:
    """Return phones with the ending -ed, without stress."""
    return phones + _ed(phones)


def _s(phones: Phones) -> Phones:
    """Return the ending -s as it sounds after ``phones``."""
    if phones[-1] in _SIBILANTS:
        return ("IH", "Z")
    return ("S",) if phones[-1] in _VOICELESS else ("Z",)


def _ed(phones: Phones) -> Phones:
    if phones[-1] in ("T", "D"):
        return ("IH", "D")
    return ("T",) if phones[-1] in _VOICELESS | {"S", "SH", "CH"} else ("D",)


def _stems(stem: str) -> Iterator[str]:
    """Yield what a stem may have been before -ed, -ing or -er: as it is, with its e, undoubled, with its y."""
    yield stem + "e"
    yield stem
    if len(stem) > 3 and stem[-1] == stem[-2]:
        yield stem[:-1]
    if stem.endswith("i"):
        yield stem[:-1] + "y"


def _inflected(key: str, lookup: Lookup) -> Iterator[tuple[Phones, str]]:
    endings: tuple[tuple[str, Callable[[Phones], Phones]], ...] = (
        ("ing", lambda _: ("IH", "NG")), ("ed", _ed), ("ers", lambda _: ("ER", "Z")), ("er", lambda _: ("ER",)),
    )
    if key.endswith("s") and len(key) > 3:
        for stem in (key[:-1], key[:-2] if key.endswith("es") else "", key[:-3] + "y" if key.endswith("ies") else ""):
            for phones in lookup(stem)[:1] if stem else []:
                yield phones + _s(phones), f"{stem} + s"
    for ending, sound in endings:
        if key.endswith(ending) and len(key) > len(ending) + 2:
            for stem in _stems(key[: -len(ending)]):
                for phones in lookup(stem)[:1]:
                    yield phones + sound(phones), f"{stem} + {ending}"

def _affixed(key: str, lookup: Lookup) -> Iterator[tuple[Phones, str]]:
    for suffix, sound in _SUFFIXES:
        for stem in (key[: -len(suffix)], key[: -len(suffix) - 1] + "y") if key.endswith(suffix) else ():
            for phones in lookup(stem)[:1] if len(stem) > 2 else []:
                yield phones + sound, f"{stem} + {suffix}"
    for prefix, sound in _PREFIXES:
        rest = key.removeprefix(prefix)
        if rest != key and len(rest) > 3:
            for phones in lookup(rest)[:1] or [p for p, _ in _inflected(rest, lookup)][:1]:
                yield sound + phones, f"{prefix} + {rest}"


def _compound(key: str, lookup: Lookup) -> Iterator[tuple[Phones, str]]:
    for cut in range(len(key) - 4, 3, -1):
        first, second = lookup(key[:cut]), lookup(key[cut:])
        if first and second:
            yield first[0] + second[0], f"{key[:cut]} + {key[cut:]}"
