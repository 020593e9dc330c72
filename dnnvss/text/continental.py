"""Numbers as they are written on the continent of Europe, in the English way."""

import re

from dnnvss.text.amounts import any_unit

_SPACE = r"[ \u00a0\u2009\u202f]"
_BOTH = re.compile(rf"(?<![\w.,])(\d{{1,3}}(?:(?:\.\d{{3}})+|(?:{_SPACE}\d{{3}})+)),(\d{{1,2}})(?![\d,]|\.\d)")
"""Dots or spaces between thousands, and a comma before decimals: ``1.234,56``."""
_MILLIONS = re.compile(r"(?<![\w.,])[1-9]\d{0,2}(?:\.\d{3}){2,}(?![\d.,]\d|\d)")
"""Dots between thousands alone, where there are two and more (``1.000.000``)."""
_PRICED = re.compile(r"(?<=[$€£])(\s?\d{1,3})\.000(?![\d.,]\d|\d)|(?<![\w.,])(\d{1,3})\.000(?=\s?(?:€|EUR\b))")
_ADDRESS = 255
"""The largest part of the address of a machine, which has four (``192.168.100.200``)."""


def in_english(text: str) -> str:
    """A text with commas between thousands and dots before decimals, where dots, spaces and commas can only be the
    other way round: ``1.234,56``, ``1.000.000``, ``€1.000``, ``1,5 km``, ``5,5%``.
    """
    if not re.search(r"\d[.,]\d", text):
        return text
    text = _BOTH.sub(lambda m: re.sub(rf"\.|{_SPACE}", ",", m[1]) + "." + m[2], text)
    text = _MILLIONS.sub(_thousands, text)
    text = _PRICED.sub(lambda m: f"{m[1] or m[2]},000", text)
    return _measured().sub(r"\1.\2", text) if re.search(r"\d,\d", text) else text


def _thousands(match: re.Match[str]) -> str:
    parts = match[0].split(".")
    machine = len(parts) == 4 and all(int(part) <= _ADDRESS and part == str(int(part)) for part in parts)
    return match[0] if machine else ",".join(parts)


def _measured() -> re.Pattern[str]:
    """A number with a comma before its decimals and what is measured behind it."""
    return re.compile(rf"(?<![\w.,$€£])(\d{{1,3}}),(\d{{1,2}})(?=\s?(?:%|‰|{any_unit()}(?![\w\u00b2\u00b3])"
                      r"|(?:percent|[mb]illion|trillion|degrees|(?:kilo|centi|milli)?meters)\b))")
