# ruff: noqa: RUF001  (marks of feet and inches look like quotes)
"""Rules of normalisation for feet and inches, and for angles: what is written with primes, or with quotes for them."""

import re

from dnnvss.text import numbers
from dnnvss.text.amounts import Rule, Said, each, rule_of

_FEET, _INCHES = r"['’′]", r"(?:[\"”″]|['’′]{2})"
_WHOLE = r"\d{1,4}(?:\.\d+)?"
_PART = r"(?:\s?(?P<part>[½¼¾]|\d/\d{1,2}))?"
_TOWARDS = {"N": "north", "S": "south", "E": "east", "W": "west"}
_PARTS = {"½": "a half", "¼": "a quarter", "¾": "three quarters"}
_OPENED = {"'": re.compile(r"(?<!\w)'(?!\s)"), "’": re.compile("‘"), '"': re.compile(r'(?<!\d)"'), "”": re.compile("“")}
_CLOSED = {"'": re.compile(r"(?<!\d)'(?!\w)"), "’": re.compile(r"(?<!\d)’(?!\w)"), '"': re.compile("(?!)"),
           "”": re.compile(r"(?<!\d)”")}
_REACH = 300  # letters before a sign in which a quotation may have begun


def _quotes(m: re.Match[str], sign: str) -> bool:
    """Return whether a sign behind a number ends a quotation that was begun before it."""
    if sign not in _OPENED:
        return False
    before = m.string[max(m.start() - _REACH, 0) : m.start()]
    opened = len(_OPENED[sign].findall(before)) - len(_CLOSED[sign].findall(before))
    return opened % 2 == 1 if sign == '"' else opened > 0


def _inches(number: str, part: str | None, british: bool) -> list[str]:
    if not part:
        return numbers.number(number, british)
    if part in _PARTS:
        return [*numbers.number(number, british), "and", *_PARTS[part].split()]
    top, bottom = map(int, part.split("/"))
    return [*numbers.number(number, british), "and", *numbers.fraction(top, bottom, british)]


def _feet_and_inches(m: re.Match[str], british: bool) -> Said:
    """A height: *five foot ten*."""
    if float(m["in"]) >= 12 or (m["sign"] is None and m["feet"] in ("'", "’") and len(m["ft"]) > 1):
        return None
    return [*numbers.cardinal(int(m["ft"]), british), "foot", *_inches(m["in"], m["part"], british)]


def _feet(m: re.Match[str], british: bool) -> Said:
    if _quotes(m, m["sign"]):
        return None
    one = m["n"] == "1" or each(m)
    return [*numbers.number(m["n"], british), "foot" if one else "feet"]


def _in_inches(m: re.Match[str], british: bool) -> Said:
    if _quotes(m, m["sign"][-1]):
        return None
    one = (m["n"] == "1" and not m["part"]) or each(m)
    return [*_inches(m["n"], m["part"], british), "inch" if one else "inches"]


def _of_inches(m: re.Match[str], british: bool) -> Said:
    if _quotes(m, m["sign"]):
        return None
    top, bottom = int(m["a"]), int(m["b"])
    return [*numbers.fraction(top, bottom, british), *([] if top > bottom or each(m) else ["of", "an"]), "inch"]


def _spelt_out(m: re.Match[str], british: bool) -> Said:
    feet, inches = (numbers.number(m[name], british) for name in ("ft", "in"))
    single = {name: m[name] == "1" or each(m) for name in ("ft", "in")}
    return [*feet, "foot" if single["ft"] else "feet", *inches, "inch" if single["in"] else "inches"]


def _angle(m: re.Match[str], british: bool) -> Said:
    words = [*numbers.number(m["d"], british), "degrees", *numbers.number(m["m"], british), "minutes"]
    words += [*numbers.number(m["s"], british), "seconds"] if m["s"] else []
    return words + ([_TOWARDS[m["to"]]] if m["to"] else [])


def _bearing(m: re.Match[str], british: bool) -> Said:
    """A latitude or longitude in degrees: *51.5° N*."""
    degrees = "degree" if m["n"] == "1" else "degrees"
    return [*numbers.number(m["n"], british), degrees, _TOWARDS[m["to"]]]


def rules() -> list[Rule]:
    """Return the rules in the order in which they are tried."""
    return [
        rule_of(rf"(?P<d>\d{{1,3}})°\s?(?P<m>\d{{1,2}}(?:\.\d+)?){_FEET}\s?(?:(?P<s>\d{{1,2}}(?:\.\d+)?){_INCHES})?"
                r"(?:\s?(?P<to>[NSEW])(?!\w))?", _angle),
        rule_of(r"(?P<n>\d{1,3}(?:\.\d+)?)°\s?(?P<to>[NSEW])(?![\w'’])", _bearing),
        rule_of(rf"(?P<ft>\d{{1,2}})(?P<feet>{_FEET})[\s-]?(?P<in>\d{{1,2}}(?:\.\d+)?){_PART}(?P<sign>{_INCHES})?"
                r"(?![\w/])", _feet_and_inches),
        rule_of(r"(?P<a>\d{1,2})/(?P<b>\d{1,2})(?P<sign>[\"”″])(?!\w)", _of_inches),
        rule_of(rf"(?P<n>{_WHOLE}){_PART}(?P<sign>{_INCHES})(?!\w)", _in_inches),
        rule_of(rf"(?P<n>{_WHOLE})(?P<sign>{_FEET})(?![\w'’′])", _feet),
        rule_of(r"(?P<ft>\d{1,2})\s?(?:ft\.?|feet|foot),?\s(?P<in>\d{1,2}(?:\.\d+)?)\s?in"
                r"(?:\.(?=\s+[a-z(]|[,;)])|(?!\w))", _spelt_out),
    ]
