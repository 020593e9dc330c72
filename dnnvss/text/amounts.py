"""What rules of numbers have in common: how a number is written, its unit, what is said of one, and *per* behind it."""

import re
from collections.abc import Callable
from functools import lru_cache

from dnnvss.text import numbers
from dnnvss.text.tokens import Token, table

Said = list[str] | list[Token] | None
Rule = tuple[re.Pattern[str], Callable[[re.Match[str], bool], Said]]

NUMBER = r"(?:\d{1,3}(?:,\d{3})+(?:\.\d+)?|\d{1,2}(?:,\d\d)+,\d{3}(?:\.\d+)?(?!\d)|\d+(?:\.\d+)?|\.\d+)"
"""A number; thousands stand between commas, on the Indian way lakhs and crores too."""
END = r"(?![\w])"
TO = r"(?:[-\u2013]|\s[-\u2013]\s)"
MINUS = r"(?P<minus>(?<![\w)%°\u20a0-\u20bf$£¥¢])[-\u2212\u2013])?"
PER = r"(?:\s?/\s?(?P<per>(?-i:[a-z]+[A-Z]?[a-z]*[\u00b2\u00b3]?|[KMGT]B|d?L|(?:1\d*\s)[a-z]+))(?![\w/]))?"
"""A stroke and what an amount is counted by, as in *5 mg/ml* and *$20/hr*."""
_SINGLE = frozenset("mgslhLWV")
"""Units of one letter that may stand behind a space."""
_EACH = re.compile(r"(?:^|[\s(\"'\u2018\u201c])an?\s$", re.IGNORECASE)


def rule_of(pattern: str, said: Callable[[re.Match[str], bool], Said], ignore_case: bool = False) -> Rule:
    """Return a rule: a pattern and what is said for what it matches."""
    return re.compile(pattern, re.IGNORECASE if ignore_case else 0), said


@lru_cache(maxsize=1)
def unit_pattern() -> str:
    """A pattern of the units of measure, in the groups ``unit`` and ``spaced``, with *per* and a dot behind them."""
    units = sorted(table("units").keys() - {"in"}, key=len, reverse=True)
    spaced = [u for u in units if len(u) > 1 or u in _SINGLE]
    goes_on = r"\.(?=\s+[a-z(]|\s*[,;:)])"
    inch = rf"in(?={goes_on})"
    end = r"(?![^\W\u00b2\u00b3]|['\u2019]\w)"
    return (rf"(?:(?P<unit>{_any(units)}|in)|\s(?P<spaced>{inch}|{_any(spaced)}(?!\s?\d))){end}{PER}(?:{goes_on})?")


def any_unit() -> str:
    """A pattern of the units of measure behind a number."""
    return _any(sorted(table("units").keys() - {"in"}, key=len, reverse=True))


def _any(signs: list[str]) -> str:
    return f"(?:{'|'.join(map(re.escape, signs))})"


def unit_words(unit: str, singular: bool) -> list[str]:
    """Return the words of a unit such as ``km/h``."""
    return table("units")[unit][0 if singular else 1].split()


def each(match: re.Match[str]) -> bool:
    """Return whether an amount is the measure of one thing (*a 10 km run*), which is said in the singular."""
    return bool(_EACH.search(match.string[max(match.start() - 4, 0) : match.start()]))


def per(match: re.Match[str]) -> list[str]:
    """Return *per* and what an amount is counted by, nothing where it is not told."""
    by = match["per"]
    if not by:
        return []
    if by[0].isdigit():
        count, what = by.split()
        return ["per", *numbers.number(count), *(unit_words(what, count == "1") if what in table("units") else [what])]
    if by in table("units") and by != "in":
        return ["per", *unit_words(by, True)]
    return [by] if by == "each" else ["per", by.lower()]
