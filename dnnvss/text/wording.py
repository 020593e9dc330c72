"""Rules of normalisation for pieces that begin with a letter: words, abbreviations, initials, acronyms, addresses."""

import re
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass, replace

from dnnvss.phones import strip_stress
from dnnvss.text import derive, numbers
from dnnvss.text.lexicon import dictionary, letter_name, looked_up, name_of
from dnnvss.text.quantities import MONTHS, plain_number
from dnnvss.text.tokens import Token, table, word_set

LONGEST = 60
"""Letters of the longest word that is read."""

_SPELT = word_set("us it am ai la ad ac dc pe led who sat ip os uk eu un tv pc hr pr ny "
                  "coo sec ev er im ib ups avi ide po")
_NAMED = word_set("aws gpu nyc usb hdmi dvd cpu usa uae sql url faq rsvp diy eta iq vip atm abc "
                  "gdp gps ucla aclu ngo raf uri fyi ct id")
"""Acronyms that are spelt however they are written."""
_CLEAR = _NAMED | word_set("ai tv pc uk eu os ip hr ny dc ev po")
"""Acronyms that are spelt in a text of capitals too."""
_NO_NOUN = word_set("us it am er un sat led")
"""Words that stand behind no article: there they are acronyms in a text of capitals too (*THE US*)."""
_ARTICLES = word_set("the a an our your my")
_SOUNDS = word_set("tsk nth pst hm mm sh hmm psst pfft brr grr")
_SHORT = 6  # letters of a word that may be an acronym in lower case
_STARTERS = word_set(
    "The He She It We They I But In And You This That These Those There A An On At My His Her Its Our Your Their "
    "What When Where Which While Who Why How All As If So For Not Now Then Here From With After Before Some Many Most "
    "Each Every Since Because However"
)
_NUMBERED = word_set(
    "chapter part war act volume section phase type book title class article bowl rocky level stage step grade scene "
    "mark windows episode fantasy model table figure appendix annex schedule unit session tier division group series "
    "season corps canto panel module round game generation factor psalm apollo saturn vol pt mk ch no nos"
)
"""Words behind which a Roman numeral is a number, not a rank."""
_PARTED = word_set("chapter part war act volume section phase article title book scene appendix annex canto vol pt ch "
                   "bowl rocky saturn apollo")
"""Those of them behind which one letter is a numeral too."""
_LETTERED = word_set(
    "vitamin grade plan type class group hepatitis letter level section option point exhibit team figure "
    "appendix column row block list part side zone gate unit flat terminal platform exit"
)
_TOP_LEVELS = ("com org net edu gov uk de fr eu io ai co us ca au info biz tv me dev app nz ie it es nl ch se "
               "ly gg fm xyz")
_ADDRESS_SIGNS = {".": "dot", "/": "slash", "-": "dash", "_": "underscore", "@": "at", ":": "colon",
                  "?": "question mark", "=": "equals", "&": "and", "#": "hash", "~": "tilde", "%": "percent",
                  "+": "plus"}


@dataclass(frozen=True)
class Place:
    """Where a piece stands: what is before it and after it in the text, and how the text is written.

    Args:
        before: the word that was last read, as written (empty at the start of a sentence).
        after: the text that follows the piece.
        british: British reading of numbers and dates.
        shouting: the text is written in capitals, so capitals mean nothing.
        joined: a sign stands right before it that joins it to what is there (*A/C*, *Q&A*).
    """

    before: str
    after: str
    british: bool
    shouting: bool
    joined: bool = False


def _has(word: str) -> bool:
    return word in dictionary()


def is_word(text: str) -> bool:
    """Return whether the dictionary has a word that is more than a row of letters: one with a vowel, and no digit."""
    return _has(text) and bool(re.search("[aeiouy]", text))


def _letters(text: str) -> list[str]:
    return [c.upper() for c in text if c.isalpha()]


_CODAS = word_set(
    "bb bs ch ck cs ct cz dd dl ds dt ff fs ft gg gh gn gs gt hl hm hn hr hs kh ks lb lc ld lf lk ll lm ln lp ls lt lz "
    "mb mm mn mp ms nc nd ng nh nk nn ns nt nx nz pf ph pp ps pt rb rc rd rf rg rk rl rm rn rp rr rs rt rv rz sh sk "
    "sm sp ss st sz th ts tt tz vs wd wk wl wn ws xt zz")
"""The two consonants in which words of English end."""
_ONSET = re.compile(
    "(?:sch|scr|shr|spl|spr|str|thr|chr|phr|b[lr]|c[hlr]|d[rw]|f[lr]|g[hlnr]|k[hlnr]|mc|p[hlnrs]|qu?|rh|s[chklmnpqtvw]|"
    "t[hrsw]|v[lr]|w[hr]|zh|[bcdfghjklmnpqrstvwxyz])?[aeiouy]")
"""How a word of English begins."""


def _readable(word: str) -> bool:
    """Whether letters can be read as a word: they begin and end as words do, and few of a kind follow each other."""
    ends = word[-2:] in _CODAS or not re.search("[^aeiouy']{2}$", word)
    return ends and bool(_ONSET.match(word)) and not re.search("[^aeiouy']{4}|[aeiou]{4}|([a-z])\\1\\1", word)


# ---- addresses -------------------------------------------------------------------------------------------------------

ADDRESS = re.compile(
    r"(?i:https?://|ftp://|www\.)[^\s<>\"]*[\w/]|[\w.+-]+@[\w-]+(?:\.[\w-]+)+"
    rf"|[A-Za-z0-9-]+(?:\.[A-Za-z0-9-]+)*\.(?:{'|'.join(_TOP_LEVELS.split())})(?:\.(?:uk|au|nz))?(?:/[^\s<>\"]*[\w/])?(?![\w])"
    r"|[A-Z0-9-]+(?:\.[A-Z0-9-]+)*\.(?:COM|ORG|NET|EDU|GOV|CO\.UK)(?![\w])"
)


def address(match: re.Match[str], place: Place) -> list[str]:
    """Return a web or mail address as it is read out: names of signs, words as words, short domains as letters."""
    text = re.sub(r"(?i)^[a-z]+://", "", match[0])
    words: list[str] = []
    for part in re.findall(r"[A-Za-z]+|\d+|[^\w\s]|_", text):
        if part.isdigit():
            words += plain_number(part, place.british)
        elif part.isalpha():
            words += _address_part(part)
        else:
            words += _ADDRESS_SIGNS.get(part, "").split()
    return words


def _address_part(part: str) -> list[str]:
    low = derive.plain(part)
    if len(low) == 1 or low in ("uk", "us", "de", "io", "ai", "tv", "eu", "edu", "html", "www", "php", "nz", "au") or (
            not _has(low) and not _readable(low)):
        return _letters(low)
    return [low]


# ---- initials, acronyms, abbreviations -------------------------------------------------------------------------------

INITIALS = re.compile(r"(?:[A-Za-z]\.){2,}(?:[A-Za-z](?![\w]))?|[A-Z]\.(?=\s?[A-Z])|[A-Z]{1,3}(?=&[A-Z])|Ph\.\s?D\.?"
                      r"|[A-G](?=#)")


def ends_sentence(after: str) -> bool:
    """Return whether a dot that belongs to an abbreviation also ends the sentence, from the text after it."""
    rest = after.lstrip("\"'\u201d\u2019) ")
    starter = re.match(r"[A-Z]\w*", rest)
    return not rest.strip() or bool(starter and starter[0] in _STARTERS)


def initials(match: re.Match[str], place: Place) -> list[Token] | None:
    """Return initials and abbreviations with inner dots: *e.g.* in words, *U.S.* as letters."""
    if match[0] == "I." and place.before and not re.match(r"\s?[A-Z]\.", place.after) and (
            not place.before[:1].isupper() or place.before.lower() in _NUMBERED | _BEFORE_I or _titled(match)):
        return None  # the pronoun, or a numeral
    if match[0] in ("V.", "X.") and place.before.lower() in _PARTED:
        return None
    key = match[0].lower().rstrip(".")
    entry = table("abbreviations").get(key)
    words = entry[0].split() if entry and "." in key else _letters(match[0])
    brk = "major" if len(key) > 1 and match[0].endswith(".") and ends_sentence(place.after) and not entry else "none"
    return [Token(match[0], tuple(words), brk)]


_MONTHS = "|".join(f"{month[:3]}(?:{month[3:]})?" for month in MONTHS) + "|sept"
ABBREVIATION = re.compile(r"(?P<word>[A-Za-z]/[A-Za-z]?(?!\w)|[A-Za-z]+|['\u2019]n['\u2019]?|[Dd]['\u2019]you)"
                          r"(?P<dot>\.(?=\d)|\.?(?![\w'\u2019]))")


def abbreviation(match: re.Match[str], place: Place) -> list[Token] | None:
    """Return an abbreviation in words, None where the piece is an ordinary word."""
    word, dot = match["word"].replace("\u2019", "'"), bool(match["dot"])
    entry = table("abbreviations").get(word.lower())
    if entry is None or (place.shouting and not dot and "/" not in word) or (word == "P" and entry[1] == "number"):
        return None
    if word == "V" or (place.joined and re.fullmatch("[A-Z]s", word)):  # a numeral; M&Ms
        return None
    said, when = entry
    capital, named = word[0].isupper(), bool(re.match(r"\s+[A-Z]", place.after))
    dated = dot and word.islower() and bool(re.match(r"\s*\d{3,4}(?!\d)", place.after))
    inside = bool(re.match(r",|\s+[a-z\d]", place.after))
    street = re.match(r"[A-Z]|\d+(?:st|nd|rd|th)$", place.before)
    if word in ("Dr", "St") and (not named or ends_sentence(place.after)) and street:
        said, when = {"Dr": "drive", "St": "street"}[word], "any"
    if word.lower() == "min" and re.match(r"\s*\d", place.after):
        said = "minimum"
    if capital and said.endswith("day") and _DATE.match(place.after):
        when = "any"
    fits = {"any": True, "dot": dot, "Dot": dot and capital, "cap": dot and capital and inside,
            "number": bool(re.match(r"\s*\(?(?:\d|[IVXL]{2,}\b)" if word.lower() == "no" else r"\s*\(?(?:\d|[IVXL]+\b)",
                                place.after)), "Year": dated, "title": capital and named,
            "Title": capital and named and dot}[when]
    if not fits or (place.after[:1].isdigit() and when not in ("number", "Year")):
        return None
    final = dot and when not in ("title", "Title", "number", "Year") and ends_sentence(place.after)
    return [Token(match[0], tuple(said.split()), "major" if final else "none")]


_DATE = re.compile(rf",?\s+(?:\d{{1,2}}(?:st|nd|rd|th)?\s+(?:of\s+)?(?:{_MONTHS})|(?:{_MONTHS})\.?\s+\d)",
                   re.IGNORECASE)
"""What follows the short name of a day."""
ROMAN = re.compile(r"(?P<numeral>[IVXL]{2,}|[IVX])(?P<ending>th|['\u2019]s)?(?![\w'\u2019])|[ivx]{2,}(?![\w'\u2019-])")
_CENTURY = re.compile(r"(?:\s|-)+(?:centur(?:y|ies)|c\.)(?!\w)", re.IGNORECASE)
_GOES_ON = re.compile(r"\s*(?:$|[.,;:!?)\u2013\u2014-])"
                      r"|\s+(?:of|and|or|to|in|is|was|were|has|began|for|by|at|on|scene)\b", re.IGNORECASE)
"""What follows *Part I*, where the letter is no pronoun."""


_RULERS = word_set(
    "henry charles george edward louis james philip alfonso ferdinand frederick pius leo gregory benedict innocent "
    "clement urban sixtus martin nicholas constantine gustav christian baldwin ptolemy olaf haakon"
)
"""Names that more than four rulers bore."""
_REIGNING = re.compile(r"\b(?:King|Queen|Pope|Emperor|Empress|Tsar|Czar|Kaiser|Sultan)\s+[A-Z]\w+\s+$")
_BEFORE_I = word_set(
    "am do did does can could will would shall should may might must have had has was were are if when as and but or "
    "so than not here there where how why what who because while though although since until yes no"
)


_PRONOUN = re.compile(r"\s+(?:am|have|know|knew|saw|see|met|love|like|think|want|had)\b")


def _titled(match: re.Match[str]) -> bool:
    """Return whether the title and the name of a ruler stand before a letter."""
    return bool(_REIGNING.search(match.string[max(match.start() - 40, 0) : match.start()]))


def _reigns(match: re.Match[str], place: Place) -> bool:
    """Return whether a single letter counts rulers of a name: *King Henry V*, *Elizabeth I of England*."""
    before = place.before
    if not before[:1].isupper() or place.shouting or before.lower() in _BEFORE_I or not before.isalpha():
        return False
    if _titled(match) or (match["numeral"] != "I" and before.lower() in _RULERS):
        return match["numeral"] != "I" or not _PRONOUN.match(place.after)
    return match["numeral"] == "I" and bool(re.match(r"\s*$|[.,;:!?)]|\s+of\s+[A-Z]", place.after))


def roman(match: re.Match[str], place: Place) -> list[str] | None:
    """Return a Roman numeral after a name or a word such as *chapter*, or of a list, in words; None elsewhere."""
    text, ending = (match["numeral"] or match[0]).upper(), match["ending"]
    value = numbers.roman(text) or {"I": 1, "V": 5, "X": 10}.get(text, 0)
    if not value:
        return None
    if ending == "th" or (not ending and len(text) > 1 and _CENTURY.match(place.after)):
        return numbers.ordinal(value, place.british) if len(text) > 1 or _CENTURY.match(place.after) else None
    said = _numeral(match, replace(place, before=_counted_together(match, place) or place.before), text, value)
    return [*said[:-1], said[-1] + "'s"] if said and ending else said


_ROW = re.compile(r"(?P<word>[A-Za-z]+)s\s+(?P<others>(?:[IVXL]+(?:,\s*|,?\s+(?:and|or|to)\s+))*)$")
"""A word in the plural and numerals behind it, before another."""
_NEXT = re.compile(r"(?:,|,?\s+(?:and|or|to))\s+[IVXL]{2,}(?!\w)")


def _counted_together(match: re.Match[str], place: Place) -> str:
    """The word that counts several numerals, as *war* in *World Wars I and II*; empty where there is none."""
    row = _ROW.search(match.string[max(match.start() - 40, 0) : match.start()])
    if row is None or row["word"].lower() not in _NUMBERED:
        return ""
    pronoun = match["numeral"] == "I" and not row["others"] and not _NEXT.match(place.after)
    return "" if pronoun else row["word"]


def _numeral(match: re.Match[str], place: Place, text: str, value: int) -> list[str] | None:
    """A numeral as a number or a rank, by the word before it; None where it is none."""
    before = place.before
    number, listed = numbers.cardinal(value, place.british), re.match(r"\)|\.\s+\S", place.after)
    if before.lower().rstrip(".") in _NUMBERED:
        lone = text == "I" and not (before.lower() == "war" or _GOES_ON.match(place.after))
        return None if len(text) == 1 and (before.lower().rstrip(".") not in _PARTED or lone) else number
    if len(text) == 1 and _reigns(match, place):
        return ["the", *numbers.ordinal(value, place.british)]
    if len(text) == 1 or "L" in text:
        return None
    if match[0].islower():
        return number if place.after[:1] == ")" else None
    if (listed and not before) or (before.isupper() and len(before) > 1 and not place.shouting):
        return number
    if not before[:1].isupper() or before in _STARTERS or (place.shouting and (len(text) < 3 or _has(text.lower()))):
        return None
    return ["the", *numbers.ordinal(value, place.british)]


_DAYS = "mon(?:day)?|tue(?:s(?:day)?)?|wed(?:nesday)?|thu(?:r(?:s(?:day)?)?)?|fri(?:day)?|sat(?:urday)?|sun(?:day)?"
SPAN = re.compile("|".join(rf"(?P<{name}1>{days})\.?[-\u2013](?P<{name}2>{days})(?![\w-])"
                           for name, days in (("day", _DAYS), ("month", _MONTHS))), re.IGNORECASE)
_FULL = {day[:3]: day for day in word_set("monday tuesday wednesday thursday friday saturday sunday") | set(MONTHS)}


def span(match: re.Match[str], place: Place) -> list[str] | None:
    """Return two days or months with *to* between them (*Mon-Fri*), None where they are no names."""
    first, last = match["day1"] or match["month1"], match["day2"] or match["month2"]
    if not (first[0].isupper() and last[0].isupper()):
        return None
    return [_FULL[first[:3].lower()], "to", _FULL[last[:3].lower()]]


# ---- words -----------------------------------------------------------------------------------------------------------

_RAISED = r"\u00b2\u00b3\u00b9\u00bc-\u00be\u2070-\u2089"
_LETTER = rf"(?:[^\W\d_{_RAISED}]|[\u0300-\u036f])"
WORD = re.compile(rf"{_LETTER}+(?:['\u2019\u02bc]{_LETTER}+)*"
                  rf"(?:[-\u2010\u2011](?:[^\W_{_RAISED}]|['\u2019])+)*['\u2019]?"
                  rf"|['\u2019]{_LETTER}+")


def word(match: re.Match[str], place: Place) -> list[str] | list[Token] | None:
    """Return the words of a run of letters, hyphens and apostrophes; None if it is not of the Latin alphabet."""
    if accented := table("accented").get(unicodedata.normalize("NFC", match[0]).lower()):
        phones = tuple(accented[0].split())
        return [Token(match[0], (name_of(phones),), phones=phones)]
    text = match[0].replace("\u2019", "'").replace("\u02bc", "'").replace("\u2010", "-").replace("\u2011", "-")
    if "-" not in text:
        return _word(text, place)
    if _has(text.lower().strip("'")):
        return [text.lower().strip("'")]
    words: list[str] = []
    for part in text.split("-"):
        said = _hyphenated(part, place) if part else []
        if said is None:
            return None
        words += said
    return words


def _hyphenated(part: str, place: Place) -> list[str] | None:
    entry = table("abbreviations").get(part.lower())
    if entry and entry[1] == "any" and part.isupper() and not place.shouting:
        return entry[0].split()
    if part.isdigit():
        return plain_number(part, place.british)
    if re.fullmatch(r"\d0s|\d{3}0s", part):
        return numbers.decade(int(part[:-1]))
    return mixed(part, place)


MIXED = re.compile(r"[A-Za-z]+\d[A-Za-z\d]*(?![\w])")


def mixed(text: str, place: Place) -> list[str] | None:
    """Return the words of letters and digits in turn, as in MP3, B2B or iPhone12."""
    words: list[str] = []
    for part in re.findall(r"\d+|\D+", text):
        if part.isdigit():
            words += plain_number(part, place.british) if len(part) < 5 else numbers.digits(part)
            continue
        said = _letters(part) if part.isupper() and part.isalpha() and len(part) < 4 and len(text) > len(
            part) else _word(part, place)
        if said is None:
            return None
        words += said
    return words


def _word(text: str, place: Place) -> list[str] | None:
    """Return the words of one run of letters and apostrophes."""
    low = derive.plain(text)
    if not any(c.isalpha() for c in low) or foreign_letter(text) or len(low) > LONGEST:
        return None
    bare = low if _has(low) else low.strip("'")
    if len(bare) == 1:
        return [_single(text.strip("'"), place)]
    if place.joined and re.fullmatch("[A-Z]s", text):  # Q&As
        return [f"{text[0].lower()}'s"]
    if plural := re.fullmatch(r"([A-Z]{2,})('?s|s')", text):  # NASA's, ATMs
        base, ending = plural[1].lower(), plural[2].removesuffix("'")
        return [base + ending] if _is_said(base) else [*_letters(base[:-1]), base[-1] + "'s"]
    if text.isupper() and "'" not in text and (not place.shouting or bare in _CLEAR or not _has(bare)):
        return _acronym(bare)
    if text.isupper() and bare in _NO_NOUN and place.before.lower() in _ARTICLES:
        return _letters(bare)
    if bare in _NAMED or (text.islower() and len(bare) < _SHORT and not _has(bare) and _is_spelt(bare)):
        return _letters(bare)
    if cut := re.fullmatch(r"([a-z]+)([A-Z]{2,})", text):  # iOS, mRNA
        return [w for part in cut.groups() for w in _word(part, place) or []]
    if re.fullmatch(r"[A-Z]\w*[A-Z]s'?", text) and _has(bare[:-1]):  # PhDs
        return [bare]
    known = _has(bare) or _has(bare.removesuffix("'s"))
    parts = [] if known or not text.isascii() else re.findall(r"[A-Z]?[a-z']+|[A-Z]+(?![a-z])", text)
    if len(parts) > 1 and "".join(parts) == text and not text.isupper():
        return [w for part in parts for w in _word(part, place) or []]
    return [bare]


def _is_spelt(low: str) -> bool:
    """Whether letters in lower case are an acronym: no word begins so, and no sound such as *shh* is drawn out."""
    return low.isalpha() and not _readable(low) and low not in _SOUNDS and not re.search(r"(.)\1", low)


def _acronym(low: str) -> list[str]:
    if low in _NAMED:
        return _letters(low)
    if low not in _SPELT and _has(low):
        return [low]
    return [low] if len(low) > 3 and _readable(low) and low not in _SPELT else _letters(low)


def _is_said(low: str) -> bool:
    """Whether an acronym is said as a word, as NASA is, and not as the names of its letters."""
    if len(low) < 3 or not _readable(low) or _acronym(low) != [low]:
        return False
    names = [strip_stress(phone) for letter in low for phone in letter_name(letter)]
    return all([strip_stress(phone) for phone in said] != names for said in looked_up(low))


_RECKONED = re.compile(r"\s*[+=\u00d7\u00f7^<>]\s*[\w(]|\s+&\s+[A-Z]\b")
"""What stands behind a letter that is a quantity or one of several, and no article."""


def _single(letter: str, place: Place) -> str:
    """Return a lone letter: the article *a*, the pronoun *I*, else the letter's name."""
    if letter in ("i", "I"):
        return "i"
    if letter == "a":
        listed = place.after[:1] == ")" and not place.before
        return "A" if listed or _RECKONED.match(place.after) else "a"
    if letter == "A":
        ends = r"\s*$|[.,;:!?)/&+-]|['\u2019]s" if place.shouting else (
            r"\s+(is|was|and|or|to|for)\b|\s*$|[.,;:!?)/&+-]|['\u2019]s")
        follows, before = re.match(ends, place.after) or _RECKONED.match(place.after), place.before.lower()
        return "A" if follows or place.joined or before in _LETTERED or before == "an" else "a"
    return derive.plain(letter).upper()


def foreign_letter(text: str) -> str:
    """Return the first letter of a run that has no Latin base letter, empty if none."""
    return next((c for c in text if c.isalpha() and not derive.plain(c)), "")


STATE = re.compile(r"(?P<state>[A-Z]{2})(?P<between>,?\s+)(?P<zip>\d{5})(?:-(?P<more>\d{4}))?(?![\w-])")


def state(match: re.Match[str], place: Place) -> list[Token] | None:
    """Return a state of the US before its postal code, by its name, and the code digit by digit."""
    name = table("states").get(match["state"])
    listed = match.string[: match.start()].rstrip().endswith(",")
    if name is None or (match["state"] in ("IN", "OR", "ME", "OK", "HI", "OH") and not listed):
        return None
    code = numbers.digits(match["zip"] + (match["more"] or ""))
    digits = match[0][match.end("between") - match.start() :]
    return [Token(match["state"], tuple(name[0].split())), Token(digits, tuple(code))]


BY = re.compile(r"x(?=\s?\d)")
_MEASURED = re.compile(r"\d\s?(?:(?:ft|in|m|cm|mm|km|yd|px)\.?|['\"\u2019\u201d\u2032\u2033])?\s?$")


def by(match: re.Match[str], place: Place) -> list[str] | None:
    """Return *by* for the sign between two lengths, *times* before a power, None elsewhere."""
    if not _MEASURED.search(match.string[max(match.start() - 9, 0) : match.start()]):
        return None
    return ["times" if re.match(r"\s?\d+\^", place.after) else "by"]


RULES: tuple[tuple[re.Pattern[str], Callable[[re.Match[str], Place], list[str] | list[Token] | None]], ...] = (
    (ADDRESS, address), (STATE, state), (BY, by), (INITIALS, initials), (SPAN, span),
    (ABBREVIATION, abbreviation), (ROMAN, roman), (MIXED, lambda m, place: mixed(m[0], place)), (WORD, word),
)
"""The rules in the order in which they are tried."""
