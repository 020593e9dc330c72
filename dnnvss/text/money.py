"""Rules of normalisation for amounts of money, with their sign before or behind them."""

import re

from dnnvss.text import numbers
from dnnvss.text.amounts import MINUS, NUMBER, PER, TO, Rule, Said, each, per, rule_of

_SIGN = "|".join(re.escape(sign) + r"(?![A-Za-z])" * sign[-1].isalpha()
                 for sign in sorted(numbers.CURRENCIES, key=len, reverse=True))
_WORDS = r"thousand|million|billion|trillion|crore|lakh"
_SHORT = r"\s?(?:bn|mn|tn)|\s?m(?![\w-])|mm|[kmbt]"
_AMOUNT = rf"(?:\d+,\d\d(?![\d,])|{NUMBER})"
"""A number, with a comma before the cents as on the continent."""


_NAMED = {"dollar": "dollars", "pound": "pounds", "euro": "euros", "yen": "yen", "rupee": "rupees",
          "usd": "dollars", "gbp": "pounds", "eur": "euros"}
"""Names of currencies behind an amount that has its sign (*$5 million dollars*), as they are said."""
_KNOWN = {sign.lower(): sign for sign in numbers.CURRENCIES}


def _sign(m: re.Match[str]) -> str:
    """The sign of an amount as it is known, however it was written (*us$5*)."""
    return _KNOWN[m["sign"].lower()]


def _scaled(name: str) -> str:
    return rf"(?:(?P<{name}>[\s-]?(?:{_WORDS})|{_SHORT})(?!\w))"


def _scale(text: str | None) -> str:
    written = (text or "").strip(" -").lower()
    return numbers.SCALE_SUFFIXES.get(written, written)


def _said(m: re.Match[str], sign: str, amount: str, scale: str, british: bool) -> list[str]:
    """An amount; one of something (*a $5 note*) is named in the singular."""
    amount = re.sub(r",(\d\d)$", r".\1", amount)
    said = numbers.money(sign, amount, scale, british)
    return numbers.in_singular(sign, said) if each(m) else said


def _before(m: re.Match[str], british: bool) -> Said:
    said = _said(m, _sign(m), m["n"], _scale(m["scale"]), british)
    return [*(["minus"] if m["minus"] or m["below"] else []), *said, *per(m)]


def _named(m: re.Match[str], british: bool) -> Said:
    """An amount whose currency is told twice: it is said once."""
    one, many, *_ = numbers.CURRENCIES[_sign(m)]
    return _before(m, british) if _NAMED[m["named"].lower()] in (one, many.split()[-1]) else None


def _range(m: re.Match[str], british: bool) -> Said:
    """Two amounts; the currency is said once unless one of them has cents."""
    first, last = _scale(m["first"]), _scale(m["scale"])
    if "." in m["a"] + m["b"] and not first and not last:
        start = numbers.money(_sign(m), m["a"], "", british)
    else:
        start = [*numbers.number(m["a"], british), *first.split()]
    return [*start, "to", *_said(m, _sign(m), m["b"], last, british), *per(m)]


def _after(m: re.Match[str], british: bool) -> Said:
    amount = _said(m, _sign(m), m["n"], (m["scale"] or "").lower(), british)
    return (["minus"] if m["minus"] else []) + amount


def _range_after(m: re.Match[str], british: bool) -> Said:
    return [*numbers.number(m["a"], british), "to", *_said(m, _sign(m), m["b"], "", british)]


def rules() -> list[Rule]:
    """Return the rules in the order in which they are tried."""
    return [
        rule_of(rf"(?P<sign>{_SIGN})\s?(?P<a>{NUMBER}){_scaled('first')}?(?:{TO}(?P=sign)\s?|[-\u2013])(?P<b>{NUMBER})"
                rf"{_scaled('scale')}?{PER}(?![\w-])", _range, ignore_case=True),
        rule_of(rf"{MINUS}(?P<sign>{_SIGN})(?P<below>(?!))?\s?(?P<n>{_AMOUNT}){_scaled('scale')}?"
                rf"\s(?P<named>{'|'.join(_NAMED)})s?(?!\w)(?P<per>(?!))?", _named, ignore_case=True),
        rule_of(rf"{MINUS}(?P<sign>{_SIGN})(?P<below>[-\u2212](?=[\d.]))?\s?"
                rf"(?P<n>{_AMOUNT}){_scaled('scale')}?{PER}", _before, ignore_case=True),
        rule_of(rf"(?P<a>{NUMBER})\s?(?P<sign>{_SIGN}){TO}(?P<b>{NUMBER})\s?(?P=sign)(?![\w-])", _range_after),
        rule_of(rf"{MINUS}(?P<n>{_AMOUNT})\s?(?:(?P<scale>{_WORDS})\s?)?(?P<sign>{_SIGN})(?!\s?\d)", _after),
    ]
