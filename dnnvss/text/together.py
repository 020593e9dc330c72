"""Rules of normalisation for amounts of several units that belong together: *1h 30m*, *2 min 30 sec*, *5 lb 3 oz*."""

import re

from dnnvss.text import numbers
from dnnvss.text.amounts import Rule, Said, each, rule_of, unit_words

_END = r"(?:\.(?=\s+[a-z(]|\s*[,;:)])|(?!\w))"
_PAIRS = {"st": "lb", "kg": "g", "lb": "oz", "lbs": "oz", "m": "cm", "km": "m", "cm": "mm"}
"""A unit and the smaller one that may stand behind it."""


def _amounts(m: re.Match[str], british: bool) -> Said:
    words: list[str] = []
    for name, unit in (("h", "h"), ("m", "min"), ("s", "s")):
        if m[name] is not None:
            words += [*numbers.cardinal(int(m[name]), british), *unit_words(unit, int(m[name]) == 1 or each(m))]
    return words


def _pair(m: re.Match[str], british: bool) -> Said:
    words: list[str] = []
    for name, unit in (("a", m["large"]), ("b", m["small"])):
        words += [*numbers.number(m[name], british), *unit_words(unit, m[name] == "1" or each(m))]
    return words


def rules() -> list[Rule]:
    """Return the rules in the order in which they are tried."""
    hours, minutes = r"(?P<h>\d{1,3})\s?(?:h|hrs?\.?),?", r"(?P<m>\d{1,3})\s?(?:m|mins?\.?),?"
    seconds = r"(?P<s>\d{1,2})\s?(?:s|secs?)"
    larger = "|".join(_PAIRS)
    smaller = "|".join(dict.fromkeys(_PAIRS.values()))
    return [
        rule_of(rf"{hours}\s?(?P<m>\d{{1,2}})\s?(?:m|mins?)(?:,?\s?{seconds})?{_END}", _amounts),
        rule_of(rf"(?P<h>\d{{1,2}})h(?P<m>[0-5]\d)(?P<s>(?!))?{_END}", _amounts),
        rule_of(rf"(?P<h>(?!))?{minutes}\s?{seconds}{_END}", _amounts),
        rule_of(rf"(?P<a>\d+)\s?(?P<large>{larger})\.?,?\s(?P<b>\d+(?:\.\d+)?)\s?(?P<small>{smaller}){_END}",
                lambda m, british: _pair(m, british) if _PAIRS[m["large"]] == m["small"] else None),
    ]
