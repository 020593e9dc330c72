"""Rules of normalisation for pieces that begin with a digit or a sign of money: each a pattern and what is said."""

import re
from collections.abc import Callable

from dnnvss.text import numbers
from dnnvss.text.tokens import Token, table, word_list

Said = list[str] | list[Token] | None
Rule = tuple[re.Pattern[str], Callable[[re.Match[str], bool], Said]]

MONTHS = word_list("january february march april may june july august september october november december")
_MONTH = r"(?P<month>(?:" + "|".join(f"{m[:3]}(?:{m[3:]})?" for m in MONTHS) + r"|sept)\.?)"
_NUMBER = r"(?:\d{1,3}(?:,\d{3})+(?:\.\d+)?|\d+(?:\.\d+)?|\.\d+)"
_END = r"(?![\w])"
_SCALE = r"(?:thousand|million|billion|trillion)"
_MINUS = r"(?P<minus>(?<![\w)%°$£€¥₹¢])[-\u2212])?"
_TO = r"(?:[-\u2013]|\s[-\u2013]\s)"
BRACKETED = r"\((?:\d{3}\)\s?\d{3}[\s-]\d{4}|0\d{2,4}\)\s?\d{3,4}[\s-]\d{3,4})(?!\d)"
"""A telephone number whose first group stands in brackets."""


_DATED = re.compile(r"\b(?:in|since|of|by|until|before|after|from|year|around|circa)\s$", re.IGNORECASE)


def _unit_pattern() -> str:
    spaced = [u for u in table("units") if len(u) > 1 or u in "mg"]
    attached = sorted(table("units"), key=len, reverse=True)
    spaced.sort(key=len, reverse=True)
    return rf"(?:(?P<unit>{'|'.join(map(re.escape, attached))})|\s(?P<spaced>{'|'.join(map(re.escape, spaced))}))(?!\w)"


def plain_number(text: str, british: bool) -> list[str]:
    """Return a number as it is read on its own: 1100 to 2099 as a year, more than twelve digits one by one."""
    if text.isdigit() and len(text) == 4 and 1100 <= int(text) <= 2099:
        return numbers.year(int(text), british)
    if len(text) > 12 and text.isdigit():
        return numbers.digits(text)
    return numbers.number(text, british)


def unit_words(unit: str, singular: bool) -> list[str]:
    """Return the words of a unit such as ``km/h``."""
    return table("units")[unit][0 if singular else 1].split()


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
    return ["the", *numbers.ordinal(int(m["d"])), "of", MONTHS[_month_number(m["month"]) - 1], *year]


def _month_day(m: re.Match[str], british: bool) -> Said:
    if not _is_date(m):
        return None
    year = numbers.year(int(m["y"]), british) if m["y"] else []
    day = numbers.ordinal(int(m["d"]))
    return [MONTHS[_month_number(m["month"]) - 1], *(["the"] if british else []), *day, *year]


def _time(m: re.Match[str], british: bool) -> Said:
    hours, minutes = int(m["h"]), int(m["min"] or 0)
    half = m["half"][0].lower() + "m" if m["half"] else ""
    if hours > 24 or (m["min"] is None and not half):
        return None
    return numbers.time_of_day(hours, minutes, int(m["s"]) if m["s"] else None, half)


def _ratio(m: re.Match[str], british: bool) -> Said:
    return [*numbers.number(m["a"], british), "to", *numbers.number(m["b"], british)]


def _money(m: re.Match[str], british: bool) -> Said:
    scale = (m["scale"] or "").lower()
    scale = numbers.SCALE_SUFFIXES.get(scale, scale)
    return (["minus"] if m["minus"] else []) + numbers.money(m["sign"], m["n"], scale, british)


def _money_range(m: re.Match[str], british: bool) -> Said:
    """Two amounts; the currency is said once unless one of them has cents."""
    first, last = (numbers.SCALE_SUFFIXES.get(scale.lower(), scale.lower()) for scale in (m["first"] or "",
                                                                                          m["scale"] or ""))
    if "." in m["a"] + m["b"] and not first and not last:
        start = numbers.money(m["sign"], m["a"], "", british)
    else:
        start = [*numbers.number(m["a"], british), *first.split()]
    return [*start, "to", *numbers.money(m["sign"], m["b"], last, british)]


def _money_after(m: re.Match[str], british: bool) -> Said:
    amount = numbers.money(m["sign"], m["n"], (m["scale"] or "").lower(), british)
    return (["minus"] if m["minus"] else []) + amount


def _range_of_units(m: re.Match[str], british: bool) -> Said:
    unit = [numbers.CURRENCIES[m["sign"]][1]] if m["sign"] else unit_words(m["unit"], False)
    return [*numbers.number(m["a"], british), "to", *numbers.number(m["b"], british), *unit]


def _telephone(m: re.Match[str], british: bool) -> Said:
    groups = re.findall(r"\+?\d+", m[0])
    said = [(["plus"] if g.startswith("+") else []) + numbers.digits(g) for g in groups]
    return [Token(g, tuple(w), "none" if i == len(groups) - 1 else "minor")
            for i, (g, w) in enumerate(zip(groups, said, strict=True))]


def _ordinal(m: re.Match[str], british: bool) -> Said:
    return numbers.ordinal(int(m["n"].replace(",", "")), british)


def _fraction(m: re.Match[str], british: bool) -> Said:
    if m[0] == "24/7":
        return ["twenty", "four", "seven"]
    if m[0] == "9/11":
        return ["nine", "eleven"]
    if not int(m["b"]):
        return None
    whole = [*numbers.cardinal(int(m["whole"]), british), "and"] if m["whole"] else []
    return whole + numbers.fraction(int(m["a"]), int(m["b"]), british)


_VULGAR = {"½": "half", "⅓": "third", "⅔": "two thirds", "¼": "quarter", "¾": "three quarters", "⅛": "eighth"}


def _vulgar(m: re.Match[str], british: bool) -> Said:
    part = _VULGAR[m["f"]]
    tail = part if " " in part else f"{'an' if part == 'eighth' else 'a'} {part}"
    return [*numbers.cardinal(int(m["n"]), british), "and", *tail.split()]


def _range(m: re.Match[str], british: bool) -> Said:
    unit = m["unit"] or m["spaced"]
    return [*plain_number(m["a"], british), "to", *plain_number(m["b"], british),
            *(unit_words(unit, False) if unit else [])]


def _quantity(m: re.Match[str], british: bool) -> Said:
    unit = m["unit"] or m["spaced"]
    if unit == "p" and float(m["n"].replace(",", "")) >= 240:  # 1080p is a picture, not a price
        return [*numbers.number(m["n"], british), "P"]
    sign = ["minus"] if m["minus"] else []
    return [*sign, *numbers.number(m["n"], british), *unit_words(unit, m["n"] == "1")]


def _compound(m: re.Match[str], british: bool) -> Said:
    return [*plain_number(m["n"], british), *m["words"].strip("-").split("-")]


def _mixed(m: re.Match[str], british: bool) -> Said:
    """Digits and letters in turn, as in 3D or 10K: the letters are named."""
    words: list[str] = []
    for part in re.findall(r"\d+|[A-Za-z]+", m[0]):
        words += plain_number(part, british) if part.isdigit() else [c.upper() for c in part]
    return words


def _versions(m: re.Match[str], british: bool) -> Said:
    words: list[str] = []
    for part in m[0].split("."):
        words += (["point"] if words else []) + numbers.number(part, british)
    return words


def _plain(m: re.Match[str], british: bool) -> Said:
    sign = {"-": ["minus"], "\u2212": ["minus"], "+": ["plus"]}.get(m["sign"] or "", [])
    if not sign and re.fullmatch(r"1[01]\d\d", m["n"]) and _DATED.search(m.string[: m.start()]):
        return numbers.year(int(m["n"]), british)
    return [*sign, *plain_number(m["n"], british)]


def rules() -> list[Rule]:
    """Return the rules in the order in which they are tried."""
    unit, i = _unit_pattern(), re.IGNORECASE
    units = "|".join(map(re.escape, sorted(table("units"), key=len, reverse=True)))
    scale = rf"{_SCALE}|bn|mn|tn|[kmb]"
    half = r"(?P<half>[ap]\.?m\b\.?)"
    pairs: list[tuple[str, int, Callable[[re.Match[str], bool], Said]]] = [
        (rf"(?P<y>\d{{4}})-(?P<m>\d\d)-(?P<d>\d\d){_END}", 0, _iso_date),
        (rf"(?P<y>\d{{4}})/(?P<m>\d{{1,2}})/(?P<d>\d{{1,2}}){_END}", 0, _iso_date),
        (rf"(?P<a>\d{{1,2}})/(?P<b>\d{{1,2}})/(?P<y>\d{{4}}|\d\d){_END}", 0, _slash_date),
        (rf"(?:the\s)?(?P<d>\d{{1,2}})(?:st|nd|rd|th)?\s(?:of\s)?{_MONTH}(?:,?\s(?P<y>\d{{4}}))?{_END}", i, _day_month),
        (rf"{_MONTH}\s(?:the\s)?(?P<d>\d{{1,2}})(?:st|nd|rd|th)?(?:,?\s(?P<y>\d{{4}}))?(?![\w:]|,\d|\s?{half}|\s?%|-\d)",
         i, _month_day),
        (rf"(?P<h>\d{{1,2}}):(?P<min>[0-5]\d)(?::(?P<s>[0-5]\d))?(?:\s?{half})?{_END}", i, _time),
        (rf"(?P<h>\d{{1,2}})(?:\.(?P<min>[0-5]\d))?(?P<s>)\s?{half}{_END}", i, _time),
        (rf"(?P<a>\d+):(?P<b>\d+){_END}", 0, _ratio),
        (rf"(?P<sign>[$£€¥₹])\s?(?P<a>{_NUMBER})(?:\s?(?P<first>{scale}))?(?:{_TO}(?P=sign)\s?|[-\u2013])(?P<b>{_NUMBER})"
         rf"(?:\s?(?P<scale>{scale}){_END})?(?![\w-])", i, _money_range),
        (rf"{_MINUS}(?P<sign>[$£€¥₹])\s?(?P<n>{_NUMBER})(?:\s?(?P<scale>{scale}){_END})?", i, _money),
        (rf"\+\d{{1,3}}(?:[\s-]\(?\d{{2,5}}\)?){{2,4}}(?!\d)|{BRACKETED}|\d{{3}}-\d{{3}}-\d{{4}}(?!\d)"
         r"|\d{3}-\d{4}(?!\d)|0\d{2,4}\s\d{3,4}\s\d{3,4}(?!\d)", 0, _telephone),
        (rf"(?P<n>\d{{1,3}}(?:,\d{{3}})+|\d+)(?:st|nd|rd|th){_END}", i, _ordinal),
        (rf"(?:['\u2019](?=\d\d['\u2019]?s))?(?P<n>\d{{2}}|\d{{4}})['\u2019]?s{_END}", 0,
         lambda m, _: numbers.decade(int(m["n"]))),
        (rf"(?:(?P<whole>\d+)\s)?(?P<a>\d{{1,3}})/(?P<b>\d{{1,3}}){_END}", 0, _fraction),
        (r"(?P<n>\d+)\s?(?P<f>[½⅓⅔¼¾⅛])", 0, _vulgar),
        (rf"(?P<a>{_NUMBER})\s?(?:(?P<sign>[$£€¥₹])|(?P<unit>{units})){_TO}(?P<b>{_NUMBER})\s?(?:(?P=sign)|(?P=unit))"
         r"(?![\w-])", 0, _range_of_units),
        (rf"{_MINUS}(?P<n>{_NUMBER})\s?(?:(?P<scale>{_SCALE})\s?)?(?P<sign>[$£€¥₹])(?!\s?\d)", i, _money_after),
        (rf"(?P<a>{_NUMBER})\s?[\u2013\u2014-]\s?(?P<b>{_NUMBER})(?:{unit})?(?![\w-])", 0, _range),
        (rf"\d+(?:\.\d+){{2,}}{_END}", 0, _versions),
        (rf"{_MINUS}(?P<n>{_NUMBER}){unit}", 0, _quantity),
        (rf"(?P<n>\d+)(?P<words>(?:-[A-Za-z]+)+){_END}", 0, _compound),
        (rf"\d+(?:[A-Za-z]+\d*)+{_END}", 0, _mixed),
        (rf"(?P<sign>(?<![\w)%°$£€¥₹¢])[-\u2212+])?(?P<n>{_NUMBER})", 0, _plain),
    ]
    return [(re.compile(pattern, flags), handler) for pattern, flags, handler in pairs]
