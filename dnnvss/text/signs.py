# ruff: noqa: RUF001  (signs that look like others are what this is about)
"""Signs of Unicode that are other ways to write letters, digits and apostrophes, as those that the rules know."""

import re
import unicodedata

from dnnvss.text.continental import in_english
from dnnvss.text.tokens import table

_UNSEEN = re.compile(r"[\u00ad\u034f\u061c\u180e\u200c-\u200f\u202a-\u202e\u2060-\u2064\u2066-\u2069"
                     r"\ufeff\ufe00-\ufe0f\u20e3\U000e0020-\U000e007f]")
"""Soft hyphens, joiners, marks of direction and keys around digits: they show nothing and part no words."""
_APOSTROPHE = re.compile(r"(?<=[^\W\d_])[`´‘‛ʹʻʽ′＇](?=[^\W\d_])")
_RAISED = re.compile(r"[⁰¹²³⁴-⁹⁺⁻ⁿ]+")
_DEGREES = re.compile(r"(?<=\d)\s?[º°]\s?(?=[CF]\b)|(?<=\d)º(?!\w)")
"""The sign of degrees, or the raised o that is typed for it."""
_OTHER = re.compile(r"[^\x00-\x7f]")
_TYPED = {"+/-": "±", "<=": "≤", ">=": "≥", "!=": "≠", "-->": "→", "->": "→", "=>": "→", "<-": "←"}
"""Signs that keyboards lack, as they are typed between two blanks (*+/-* anywhere)."""
_AS_TYPED = re.compile(r"\+/-|(?<!\S)(?:[<>!]=|-{1,2}>|=>|<-)(?!\S)|(?<=[\w)])[<>!]=(?=[\w(-])")
_APART = ("<circle>",)
_THOUSANDS = re.compile(r"(?<![\d.,+-])(?<!\d\s)[1-9]\d{0,2}"
                        r"(?:(?:[\u00a0\u2009\u202f'\u2019_]\d{3})+|(?:\s\d{3})*\s000)(?![\s-]?\d)")
"""A number with spaces between its thousands; plain ones part two numbers, but hardly before three zeros."""
_KEPT = frozenset("…½⅓⅔¼¾⅛ªº⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻ⁿ™№´¨″‴µ")


def visible(text: str) -> str:
    """Return a text without the signs that show nothing."""
    return _UNSEEN.sub("", text)


def plain_signs(text: str) -> str:
    """Return a text with the signs that rules know: no invisible ones, letters and digits of any style as ASCII.

    Raised digits that are a power stand behind ``^`` (``10⁶`` is ``10^6``; squares and cubes stay, for units), those
    behind a longer word or a sign mark a footnote and go. Lowered ones are digits (``CO₂``), and so are those of other
    scripts; fractions are written with a stroke (``⅝`` is ``5/8``), numbers as in English (``1.234,5`` is ``1,234.5``),
    signs and spaces between thousands become commas, and an apostrophe between letters is straight, whichever sign was
    typed for it.
    """
    text = _AS_TYPED.sub(lambda m: _TYPED[m[0]], in_english(text))
    text = _APOSTROPHE.sub("'", unicodedata.normalize("NFC", visible(text)))
    text = _THOUSANDS.sub(lambda m: re.sub(r"[\s'\u2019_]", ",", m[0]), text)
    if text.isascii():
        return text
    text = _RAISED.sub(_power, text)
    return _OTHER.sub(_plain, _DEGREES.sub("°", text))


def _power(match: re.Match[str]) -> str:
    """Raised digits: a power, or the number of a footnote."""
    before = match.string[max(match.start() - 3, 0) : match.start()]
    if (len(before) == 3 and before.isalpha()) or before.endswith(tuple(".,;:!?\"'”’")):
        return ""
    if match[0] in "²³":
        return match[0]
    return "^" + unicodedata.normalize("NFKC", match[0]).replace("\u2212", "-")


def _plain(match: re.Match[str]) -> str:
    """A sign as ASCII, itself where it is no other way to write one."""
    sign = match[0]
    if (digit := unicodedata.decimal(sign, None)) is not None:
        return str(digit)
    kind = unicodedata.decomposition(sign).partition(" ")[0]
    if not kind.startswith("<") or sign in _KEPT or sign in table("symbols"):
        return sign
    same = "".join(chr(int(code, 16)) for code in unicodedata.decomposition(sign).split()[1:])
    if kind == "<fraction>":
        digit = match.string[match.start() - 1 : match.start()].isdigit()
        return (" " if digit else "") + same.replace("\u2044", "/")
    same = "".join(_plain_letter(c) for c in same)
    if not all((c.isascii() and c.isprintable()) or c in "°²³μ" for c in same):
        return sign
    return f" {same} " if kind in _APART else same


def _plain_letter(sign: str) -> str:
    """A sign that another is made of (the ligature in *ﬃ*) as ASCII; squares and cubes stay."""
    return sign if sign in "²³" else unicodedata.normalize("NFKC", sign)
