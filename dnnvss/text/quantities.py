"""Rules of normalisation for pieces that begin with a digit or a sign of money: each a pattern and what is said."""

import re

from dnnvss.text import hours, lengths, money, numbers, together
from dnnvss.text.amounts import (
    END,
    MINUS,
    NUMBER,
    TO,
    Rule,
    Said,
    any_unit,
    each,
    per,
    rule_of,
    unit_pattern,
    unit_words,
)
from dnnvss.text.tokens import Token, table, word_list

MONTHS = word_list("january february march april may june july august september october november december")
_MONTH = r"(?P<month>(?:" + "|".join(f"{m[:3]}(?:{m[3:]})?" for m in MONTHS) + r"|sept)\.?)"
BRACKETED = r"\((?:\d{3}\)\s?\d{3}[\s-]\d{4}|0\d{2,4}\)\s?\d{3,4}[\s-]\d{3,4})(?!\d)"
"""A telephone number whose first group stands in brackets."""


_DIALLED = re.compile(r"\b(?:call(?:ed)?|dial(?:l?ed)?|ring|phone)\s$", re.IGNORECASE)
_CURRENT = re.compile(r"\s(?:fuse|charger|current|circuit|breaker|supply|battery|at\b|@|\d+\s?V)")
_RECKONED = re.compile(r"\s*(?:[=+^\u00b2\u00b3\u2212]|-(?![a-z]))")
"""What follows an unknown of algebra (*2x + 1*)."""
_BOOK = re.compile(r"\b(?:Genesis|Exodus|Leviticus|Numbers|Deuteronomy|Joshua|Judges|Ruth|Samuel|Kings|Chronicles|Job"
                   r"|Psalms?|Proverbs|Ecclesiastes|Isaiah|Jeremiah|Ezekiel|Daniel|Hosea|Joel|Amos|Micah|Malachi"
                   r"|Matthew|Mark|Luke|John|Acts|Romans|Corinthians|Galatians|Ephesians|Philippians|Colossians"
                   r"|Thessalonians|Timothy|Titus|Hebrews|James|Peter|Jude|Revelation|Quran|Surah)\s$")
"""What stands before a chapter and a verse."""
_WORDED = "|".join(sorted((u for u in table("units") if u in "mg" or (u.isalpha() and u.islower() and len(u) > 1)),
                          key=len, reverse=True))
"""Units that stand behind a hyphen."""
_TIMES = "yr|year|mo|month|wk|week|day|hr|hour|h|min|minute|sec|second|s|night|person|mile|km|kg|lb"
_MARK = re.compile(r"(?!\s+(?:of|an?|the|as|inch|mile|full|way|gallon|acre|cent)\b)")
"""What follows a mark of ten or a hundred (*9/10*), and no part of something."""
_DATED = re.compile(r"\b(?:in|since|of|by|until|before|after|from|year|around|circa)\s$", re.IGNORECASE)


def plain_number(text: str, british: bool) -> list[str]:
    """Return a number as it is read on its own: 1100 to 2099 as a year, more than twelve digits one by one."""
    if text.isdigit() and len(text) == 4 and 1100 <= int(text) <= 2099:
        return numbers.year(int(text), british)
    if len(text) > 12 and text.isdigit():
        return numbers.digits(text)
    return numbers.number(text, british)


def _date_words(day: int, month: int, year: int | None, british: bool) -> list[str] | None:
    if not (1 <= month <= 12 and 1 <= day <= 31):
        return None
    date = ["the", *numbers.ordinal(day), "of", MONTHS[month - 1]] if british else [MONTHS[month - 1],
                                                                                    *numbers.ordinal(day)]
    return date + (numbers.year(year, british) if year is not None else [])


def _iso_date(m: re.Match[str], british: bool) -> Said:
    return _date_words(int(m["d"]), int(m["m"]), int(m["y"]), british)


def _slash_date(m: re.Match[str], british: bool) -> Said:
    first, second = int(m["a"]), int(m["b"])
    day, month = (first, second) if british or first > 12 else (second, first)
    day, month = (month, day) if month > 12 else (day, month)
    year = int(m["y"])
    return _date_words(day, month, year + (2000 if year < 50 else 1900) if len(m["y"]) == 2 else year, british)


def _month_number(name: str) -> int:
    return next(i for i, month in enumerate(MONTHS, 1) if month.startswith(name.lower().rstrip(".")[:3]))


def _is_date(m: re.Match[str]) -> bool:
    """Return whether there is such a day; small *may* and *march* are verbs unless more speaks for a date."""
    sure = m["y"] or re.search(r"\sof\s|\d(?:st|nd|rd|th)$", m[0], re.IGNORECASE)
    return 1 <= int(m["d"]) <= 31 and bool(sure or m["month"] not in ("may", "march"))


def _day_month(m: re.Match[str], british: bool) -> Said:
    year = numbers.year(int(m["y"]), british) if m["y"] else []
    if not _is_date(m):
        return None
    first = ["the", *numbers.ordinal(int(m["from"])), "to"] if m["from"] else []
    return [*first, "the", *numbers.ordinal(int(m["d"])), "of", MONTHS[_month_number(m["month"]) - 1], *year]


def _month_day(m: re.Match[str], british: bool) -> Said:
    if not _is_date(m):
        return None
    year = numbers.year(int(m["y"]), british) if m["y"] else []
    day = numbers.ordinal(int(m["d"]))
    if m["until"]:
        day += ["to", *(["the"] if british else []), *numbers.ordinal(int(m["until"]))]
    return [MONTHS[_month_number(m["month"]) - 1], *(["the"] if british else []), *day, *year]


def _named_date(m: re.Match[str], british: bool) -> Said:
    return _date_words(int(m["d"]), _month_number(m["month"]), int(m["y"]), british=True)


def _ratio(m: re.Match[str], british: bool) -> Said:
    verse = _BOOK.search(m.string[max(m.start() - 20, 0) : m.start()])
    return [*numbers.number(m["a"], british), *([] if verse else ["to"]), *numbers.number(m["b"], british)]


def _range_of_units(m: re.Match[str], british: bool) -> Said:
    unit = unit_words(m["unit"], each(m))
    return [*numbers.number(m["a"], british), "to", *numbers.number(m["b"], british), *unit]


def _telephone(m: re.Match[str], british: bool) -> Said:
    groups = re.findall(r"\+?\d+", m[0])
    said = [(["plus"] if g.startswith("+") else []) + numbers.digits(g) for g in groups]
    return [Token(g, tuple(w), "none" if i == len(groups) - 1 else "minor")
            for i, (g, w) in enumerate(zip(groups, said, strict=True))]


def _groups(m: re.Match[str], british: bool) -> Said:
    """Three or more numbers with hyphens between them: short ones as numbers (*4-4-2*), long ones digit by digit."""
    parts = m[0].split("-")
    if all(len(part) < 3 and not part.startswith("0") for part in parts):
        return [word for part in parts for word in numbers.cardinal(int(part), british)]
    return _telephone(m, british)


def _ordinal(m: re.Match[str], british: bool) -> Said:
    if m["n"][-1] != "1" and m[0].endswith("st"):  # a weight
        return None
    return numbers.ordinal(int(m["n"].replace(",", "")), british)


def _fraction(m: re.Match[str], british: bool) -> Said:
    if m[0] == "24/7":
        return ["twenty", "four", "seven"]
    if m[0] == "9/11":
        return ["nine", "eleven"]
    top, bottom = int(m["a"]), int(m["b"])
    if not bottom:
        return None
    if top == bottom and not m["whole"] and top > 1:  # 50/50, 20/20
        return [*numbers.cardinal(top, british), *numbers.cardinal(bottom, british)]
    if bottom in (10, 100) and 1 < top <= bottom and not m["whole"] and m[0].endswith(m["b"]) and _MARK.match(
            m.string, m.end()):
        return [*numbers.cardinal(top, british), "out", "of", *numbers.cardinal(bottom, british)]
    whole = [*numbers.cardinal(int(m["whole"]), british), "and"] if m["whole"] else []
    return [*whole, *numbers.fraction(top, bottom, british), *_unit(m, bool(m["whole"]) or top > bottom)]


def _fraction_range(m: re.Match[str], british: bool) -> Said:
    """From one fraction or number to another: *1/4-1/2 tsp*, *1/2-1 cup*."""
    if "0" in (m["b"], m["d"]) or not (m["b"] or m["d"]):
        return None
    first, last = (numbers.fraction(int(m[top]), int(m[bottom]), british) if m[bottom]
                   else numbers.cardinal(int(m[top]), british) for top, bottom in ("ab", "cd"))
    return [*first, "to", *last, *_unit(m, several=not m["d"] and m["c"] != "1")]


def _unit(m: re.Match[str], several: bool) -> list[str]:
    """The unit behind a number, and *per* what."""
    unit = m["unit"] or m["spaced"]
    return [*(unit_words(unit, not several or each(m)) if unit else []), *per(m)]


_VULGAR = {"½": "half", "⅓": "third", "⅔": "two thirds", "¼": "quarter", "¾": "three quarters", "⅛": "eighth"}


def _vulgar(m: re.Match[str], british: bool) -> Said:
    part = _VULGAR[m["f"]]
    if not m["n"]:
        return [*(part if " " in part else f"one {part}").split(), *_unit(m, several=False)]
    tail = part if " " in part else f"{'an' if part == 'eighth' else 'a'} {part}"
    return [*numbers.cardinal(int(m["n"]), british), "and", *tail.split(), *_unit(m, several=True)]


def _year_on(m: re.Match[str], british: bool) -> Said:
    """A year and the next or a later one of its century: *2008-09*."""
    first, last = int(m["a"]), int(m["b"])
    if not (1100 <= first <= 2099 and (last > first % 100 or (last == 0 and first % 100 == 99))):
        return None
    return [*numbers.year(first, british), "to", *(_two_digits(last) if last else numbers.year(first + 1, british))]


def _two_digits(number: int) -> list[str]:
    """The end of a year: *oh nine*, *eighteen*; of *'00* all of it."""
    return numbers.year(1900 + number)[1:] if number else ["two", "thousand"]


def _range(m: re.Match[str], british: bool) -> Said:
    between = "minus" if re.match(r"\s*=", m.string[m.end() : m.end() + 9]) else "to"
    return [*plain_number(m["a"], british), between, *plain_number(m["b"], british), *_unit(m, several=True)]


def _product(m: re.Match[str], british: bool) -> Said:
    """Two or three lengths (*4x4*, *5 x 3 m*), or factors where a result follows."""
    times = "times" if re.match(r"\s*=", m.string[m.end() : m.end() + 9]) else "by"
    words = plain_number(m["a"], british)
    for part in re.findall(NUMBER, m["more"]):
        words += [times, *plain_number(part, british)]
    return [*words, *_unit(m, several=True)]


def _season(m: re.Match[str], british: bool) -> Said:
    """Two years that follow each other: *2001/02*."""
    if (int(m["a"]) + 1) % 100 != int(m["b"]):
        return None
    return [*numbers.year(int(m["a"]), british), *_two_digits(int(m["b"]))]


def _decades(m: re.Match[str], british: bool) -> Said:
    return [*numbers.decade(int(m["a"])), "to", *numbers.decade(int(m["b"]))]


def _decade(m: re.Match[str], british: bool) -> Said:
    """A decade; *45s* is a time."""
    seconds = len(m["n"]) == 2 and m["n"][1] != "0" and m[0] == m["n"] + "s"
    return None if seconds else numbers.decade(int(m["n"]))


def _possessive(m: re.Match[str], british: bool) -> Said:
    """What belongs to a thing with a number: *Channel 4's*."""
    *start, last = plain_number(m["n"], british)
    return [*start, last + "'s"]


def _counted(m: re.Match[str], british: bool) -> Said:
    """So many of something in a time or for one: *365 days/yr*."""
    what = unit_words(m["what"], m["n"] == "1") if m["what"] in table("units") else [m["what"]]
    return [*numbers.number(m["n"], british), *what, *per(m)]


def _power(m: re.Match[str], british: bool) -> Said:
    if m["n"] in ("2", "3"):
        return ["squared" if m["n"] == "2" else "cubed"]
    if m["n"][-1].isalpha():
        return ["to", "the", "power", "of", *(["minus"] if len(m["n"]) > 1 else []), m["n"][-1].upper()]
    return ["to", "the", "power", "of", *numbers.number(m["n"], british)]


def _quantity(m: re.Match[str], british: bool) -> Said:
    unit = m["unit"] or m["spaced"]
    if unit == "p" and float(m["n"].replace(",", "")) >= 240:  # 1080p is a picture, not a price
        return [*numbers.number(m["n"], british), "P"]
    if unit == "x" and _RECKONED.match(m.string, m.end()):
        return [*(["minus"] if m["minus"] else []), *numbers.number(m["n"], british), "X"]
    if unit == "A" and "." not in m["n"] and not _CURRENT.match(m.string, m.end()):  # a flat or a gate
        return None
    sign = ["minus"] if m["minus"] else []
    single = m["n"] == "1" or (unit != "p" and each(m))
    return [*sign, *numbers.number(m["n"], british), *unit_words(unit, single), *per(m)]


def _short_scale(m: re.Match[str], british: bool) -> Said:
    return [*numbers.number(m["n"], british), numbers.SCALE_SUFFIXES[m["scale"].lower()]]


def _plural(m: re.Match[str], british: bool) -> Said:
    """As in *100s of people*."""
    count = int(m["n"].replace(",", ""))
    *start, last = numbers.decade(count) if count < 100 else numbers.cardinal(count, british)
    return [*([] if start == ["one"] else start), last if last.endswith("s") else last + "s"]


def _hyphenated(m: re.Match[str], british: bool) -> Said:
    """A measure of one thing with a hyphen: *a 5-kg bag*, *6-ft-tall*."""
    return [*plain_number(m["n"], british), *unit_words(m["unit"], singular=True)]


def _scientific(m: re.Match[str], british: bool) -> Said:
    power = numbers.number(m["e"], british)
    return [*numbers.number(m["n"], british), "times", "ten", "to", "the", "power", "of", *power]


def _compound(m: re.Match[str], british: bool) -> Said:
    return [*plain_number(m["n"], british), *m["words"].replace("\u2019", "'").strip("-").split("-")]


def _mixed(m: re.Match[str], british: bool) -> Said:
    """Digits and letters in turn, as in 3D or 10K: the letters are named; words among them are left to their rule."""
    if re.search("[a-z]{2}|[A-Z]([a-rt-z]|[A-Z]{3})", m[0]):
        return None
    words: list[str] = []
    for part in re.findall(r"\d+|[A-Za-z]+", m[0]):
        words += plain_number(part, british) if part.isdigit() else [c.upper() for c in part]
    return words


def _versions(m: re.Match[str], british: bool) -> Said:
    parts = m[0].split(".")
    point = "dot" if len(parts) == 4 and all(int(part) < 256 for part in parts) else "point"  # an address of a computer
    words: list[str] = []
    for part in parts:
        words += ([point] if words else []) + numbers.number(part, british)
    return words


def _plain(m: re.Match[str], british: bool) -> Said:
    sign = {"+": ["plus"]}.get(m["sign"], ["minus"]) if m["sign"] else []
    if not sign and len(m["n"]) == 3 and _DIALLED.search(m.string[max(m.start() - 9, 0) : m.start()]) and not re.match(
            r"\s(?:people|of|[a-z]+s)\b", m.string[m.end() : m.end() + 20]):
        return numbers.digits(m["n"])
    if not sign and re.fullmatch(r"1[01]\d\d", m["n"]) and _DATED.search(m.string[: m.start()]):
        return numbers.year(int(m["n"]), british)
    return [*sign, *plain_number(m["n"], british)]


_TELEPHONE = "|".join([
    r"\+\d{1,3}\s?\(0\)\s?\d{2,5}(?:[\s-]\d{3,6}){1,2}",
    r"\+\d{1,3}(?:[\s.-]\(?\d{1,5}\)?){2,5}", r"\+\d{10,15}", r"1([-. ])\d{3}\1\d{3}\1\d{4}",
    BRACKETED, r"\d{3}([-. ])\d{3}\2\d{4}", r"\d{3}-\d{4}",
    r"0\d{2,4}\s\d{3,4}\s\d{3,4}", r"0\d{4}\s\d{6}", r"0\d(?:[ .]\d\d){4}", r"\d{4}(?:[ -]\d{4}){3}"])


def _dates() -> list[Rule]:
    day = r"(?:st|nd|rd|th)?"
    return [
        rule_of(rf"(?P<y>\d{{4}})-(?P<m>\d\d)-(?P<d>\d\d)(?:{END}|T(?=\d))", _iso_date),
        rule_of(rf"(?P<y>\d{{4}})/(?P<m>\d{{1,2}})/(?P<d>\d{{1,2}}){END}", _iso_date),
        rule_of(rf"(?P<a>\d{{1,2}})(?P<by>[-/])(?P<b>\d{{1,2}})(?P=by)(?P<y>\d{{4}}|(?<=/)\d\d){END}", _slash_date),
        rule_of(rf"(?P<a>\d{{1,2}})\.(?P<b>\d{{1,2}})\.(?P<y>\d{{4}}){END}", lambda m, _: _slash_date(m, british=True)),
        rule_of(rf"(?:the\s)?(?:(?P<from>\d{{1,2}}){day}[-\u2013])?(?P<d>\d{{1,2}}){day}\s(?:of\s)?{_MONTH}"
                rf"(?:,?\s(?P<y>\d{{4}}))?{END}", _day_month, ignore_case=True),
        rule_of(rf"(?P<d>\d{{1,2}})-{_MONTH}-(?P<y>\d{{4}}){END}", _named_date, ignore_case=True),
        rule_of(rf"{_MONTH}\s(?:the\s)?(?P<d>\d{{1,2}}){day}(?:[-\u2013](?P<until>\d{{1,2}}){day})?"
                rf"(?:,?\s(?P<y>\d{{4}}))?(?![\w:]|,\d|\s?{hours.HALF}|\s?%|-\d)", _month_day, ignore_case=True),
    ]


def _many() -> list[Rule]:
    unit = unit_pattern()
    return [
        rule_of(rf"(?P<a>\d+):(?P<b>\d+){END}", _ratio),
        *money.rules(),
        rule_of(f"(?:{_TELEPHONE})(?!\\d)", _telephone),
        rule_of(r"\d+(?:-\d+){2,7}(?![\w-])", _groups),
        rule_of(rf"(?P<n>\d{{1,3}}(?:,\d{{3}})+|\d+)(?:st|nd|rd|th){END}", _ordinal, ignore_case=True),
        rule_of(rf"['\u2019]?(?P<a>\d{{2}}|\d{{4}})s[-\u2013]['\u2019]?(?P<b>\d{{2}}|\d{{4}})s{END}", _decades),
        rule_of(r"(?P<n>10{0,2}(?:,000)+|10+)['\u2019]?s(?=\sof\b)", _plural),
        rule_of(rf"(?:['\u2019](?=\d\d['\u2019]?s))?(?P<n>\d{{2}}|\d{{4}})['\u2019]?s{END}",
                _decade),
        rule_of(rf"(?P<n>\d+)['\u2019]s{END}", _possessive),
        rule_of(rf"(?P<n>{NUMBER})\s(?P<what>[a-z]{{2,12}}s)\s?/\s?(?P<per>{_TIMES})(?![\w/])", _counted),
        *lengths.rules(), *together.rules(),
        rule_of(rf"(?P<a>\d)/(?P<b>[2-8])\s?[\u2013-]\s?(?P<c>\d)(?:/(?P<d>[2-8]))?(?:{unit}|(?![\w/-]|\.\d))",
                _fraction_range),
        rule_of(rf"(?:(?P<whole>\d+)[\s-])?(?P<a>\d{{1,3}})/(?P<b>\d{{1,3}}|1000)(?:{unit}|(?:rd|th|nd)?s?{END})",
                _fraction),
        rule_of(rf"(?:(?P<n>\d+)\s?)?(?P<f>[½⅓⅔¼¾⅛])(?:{unit})?", _vulgar),
        rule_of(rf"(?P<a>{NUMBER})(?P<more>(?:\s?x\s?{NUMBER}|\u00d7{NUMBER}(?!\^)){{1,2}})(?:{unit})?(?![\w^])",
                _product),
        rule_of(rf"(?P<a>{NUMBER})\s?(?P<unit>{any_unit()}){TO}(?P<b>{NUMBER})\s?(?P=unit)(?![\w-])",
                _range_of_units),
        rule_of(r"(?P<a>\d{4})[\u2013-](?P<b>\d\d)(?![\w-]|[.,]\d)", _year_on),
        rule_of(r"(?P<a>[12]\d{3})/(?P<b>\d\d)(?![\w/-]|[.,]\d)", _season),
        rule_of(r"(?<=['\u2019])(?P<n>0\d)(?![\w-]|[.,:]\d)", lambda m, _: _two_digits(int(m["n"]))),
        rule_of(rf"(?P<a>{NUMBER})\s?[\u2013\u2014-]\s?(?P<b>{NUMBER})(?:{unit})?(?![\w-])", _range),
        rule_of(rf"\d+(?:\.\d+){{2,}}{END}", _versions),
        rule_of(rf"{MINUS}(?P<n>{NUMBER}){unit}", _quantity),
        rule_of(rf"(?P<n>{NUMBER})-(?P<unit>{_WORDED})(?![\w/])", _hyphenated),
        rule_of(rf"(?P<n>\d+(?:\.\d+)?)(?:e\+?|[eE](?=[-\u2212]))(?P<e>[-\u2212]?\d{{1,3}}){END}", _scientific),
        rule_of(rf"(?P<n>\d+\.\d+)(?P<scale>[KMB]){END}", _short_scale),
        rule_of(rf"(?P<n>{NUMBER})(?P<scale>[bmt]n|(?<!^3)(?<!\D3)[MB](?=\s(?:people|[a-z]+s)\b)){END}", _short_scale),
        rule_of(r"(?<=[\w)])\^(?P<n>[-\u2212]?(?:\d+(?:\.\d+)?|[A-Za-z](?![A-Za-z])))", _power),
    ]


def rules() -> list[Rule]:
    """Return the rules in the order in which they are tried."""
    return [
        *_dates(), *hours.rules(), *_many(),
        rule_of(rf"(?P<n>\d+)(?P<words>(?:-[a-z]+(?:['\u2019]s)?)+){END}", _compound),
        rule_of(rf"\d+(?:[A-Za-z]+\d*)+{END}", _mixed),
        rule_of(rf"(?P<sign>(?<![\w)%°\u20a0-\u20bf$£¥¢])[-\u2212\u2013+])?(?P<n>{NUMBER})", _plain),
    ]
