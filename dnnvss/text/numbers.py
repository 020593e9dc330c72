"""Numbers in words: cardinals, ordinals, years, decimals, fractions, money and times of day.

Every function returns a list of lower-case words; a single capital (``"A"``) stands for the name of a letter. British
English says *and* after the hundreds.
"""

import re

from dnnvss.text.tokens import word_list

_ONES = word_list(
    "zero one two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen "
    "sixteen seventeen eighteen nineteen"
)
_TENS = word_list("zero ten twenty thirty forty fifty sixty seventy eighty ninety")
_SCALES = ("", "thousand", "million", "billion", "trillion", "quadrillion", "quintillion")
_ORDINALS = {"one": "first", "two": "second", "three": "third", "five": "fifth", "eight": "eighth", "nine": "ninth",
             "twelve": "twelfth"}
_LARGEST = 10 ** (3 * len(_SCALES)) - 1

CURRENCIES = {
    "$": ("dollar", "dollars", "cent", "cents"), "£": ("pound", "pounds", "penny", "pence"),
    "€": ("euro", "euros", "cent", "cents"), "¥": ("yen", "yen", "", ""), "₹": ("rupee", "rupees", "paisa", "paise"),
    "Rs": ("rupee", "rupees", "paisa", "paise"), "Rs.": ("rupee", "rupees", "paisa", "paise"),
    "₩": ("won", "won", "", ""), "₽": ("ruble", "rubles", "kopeck", "kopecks"), "₺": ("lira", "lira", "", ""),
    "₱": ("peso", "pesos", "centavo", "centavos"), "₪": ("shekel", "shekels", "", ""), "฿": ("baht", "baht", "", ""),
    "₿": ("bitcoin", "bitcoins", "", ""), "₴": ("hryvnia", "hryvnias", "", ""), "₦": ("naira", "naira", "", ""),
    "₫": ("dong", "dong", "", ""), "₵": ("cedi", "cedis", "", ""),
}
"""Signs of money: one of it, several, and the same of its hundredth part, empty where there is none."""
_DOLLARS = {"US": "U S", "AU": "australian", "A": "australian", "CA": "canadian", "C": "canadian",
            "NZ": "new zealand", "HK": "hong kong", "S": "singapore", "NT": "taiwan"}
CURRENCIES |= {f"{short}$": (f"{name} dollar", f"{name} dollars", "cent", "cents") for short, name in _DOLLARS.items()}
CURRENCIES |= {"R$": ("real", "reais", "centavo", "centavos"),
               "MX$": ("mexican peso", "mexican pesos", "centavo", "centavos")}
_CODES = {"USD": "US$", "EUR": "€", "GBP": "£", "JPY": "¥", "INR": "₹", "CAD": "C$", "AUD": "A$"}
CURRENCIES |= {code: CURRENCIES[sign] for code, sign in _CODES.items()}
CURRENCIES["CHF"] = ("swiss franc", "swiss francs", "", "")
SCALE_SUFFIXES = {"k": "thousand", "m": "million", "mn": "million", "bn": "billion", "b": "billion", "tn": "trillion",
                  "t": "trillion", "mm": "million"}


def digits(text: str) -> list[str]:
    """Return the digits of a text one by one; other signs are passed over."""
    return [_ONES[int(c)] for c in text if c in "0123456789"]


def cardinal(number: int, british: bool = False) -> list[str]:
    """Return a whole number in words; beyond 21 digits it is read digit by digit."""
    if number < 0:
        return ["minus", *cardinal(-number, british)]
    if number > _LARGEST:
        return digits(str(number))
    if number < 1000:
        return _below_thousand(number, british)
    words: list[str] = []
    groups = [(number // 1000**i % 1000, scale) for i, scale in enumerate(_SCALES)]
    for value, scale in reversed(groups):
        if value:
            joined = british and words and not scale and value < 100
            words += (["and"] if joined else []) + _below_thousand(value, british) + ([scale] if scale else [])
    return words


def _below_thousand(number: int, british: bool) -> list[str]:
    if number < 20:
        return [_ONES[number]]
    if number < 100:
        return [_TENS[number // 10]] + ([_ONES[number % 10]] if number % 10 else [])
    rest = _below_thousand(number % 100, british) if number % 100 else []
    return [_ONES[number // 100], "hundred", *(["and"] if british and rest else []), *rest]


def ordinal(number: int, british: bool = False) -> list[str]:
    """Return an ordinal in words: 21 is *twenty first*."""
    *start, last = cardinal(number, british)
    if last.endswith("y"):
        return [*start, last[:-1] + "ieth"]
    return [*start, _ORDINALS.get(last, last + "th")]


def year(number: int, british: bool = False) -> list[str]:
    """Return a year in words: 1905 is *nineteen oh five*, 2000 *two thousand*, 2024 *twenty twenty four*."""
    century, rest = divmod(number, 100)
    if not 1000 <= number <= 9999 or (century % 10 == 0 and rest < 10):
        return cardinal(number, british)
    tail = ["hundred"] if not rest else ["oh", _ONES[rest]] if rest < 10 else cardinal(rest)
    return cardinal(century) + tail


def decade(number: int) -> list[str]:
    """Return a decade or century in words: 1990 is *nineteen nineties*, 80 *eighties*, 1900 *nineteen hundreds*."""
    *start, last = year(number) if number >= 100 else cardinal(number)
    return [*start, last[:-1] + "ies" if last.endswith("y") else last + "s"]


def number(text: str, british: bool = False) -> list[str]:
    """Return a written number in words: digits with thousands separators, sign and decimals, as in ``-1,234.5``.

    Leading zeros (``007``) make it a row of digits.
    """
    sign = ["minus"] if text[0] in "-\u2212" else ["plus"] if text[0] == "+" else []
    whole, _, fraction = text.lstrip("-+\u2212").replace(",", "").partition(".")
    if not whole:
        words = []
    elif len(whole) > 1 and whole.startswith("0"):
        words = digits(whole)
    else:
        words = cardinal(int(whole), british) if len(whole) < 22 else digits(whole)
    return sign + words + (["point", *digits(fraction)] if fraction else [])


def fraction(top: int, bottom: int, british: bool = False) -> list[str]:
    """Return a fraction in words: 3/4 is *three quarters*, 7/100 *seven over one hundred*."""
    if bottom == 2:
        names = ["half"] if top == 1 else ["halves"]
    elif bottom == 4:
        names = ["quarter"] if top == 1 else ["quarters"]
    elif 2 < bottom <= 20:
        names = ordinal(bottom)
        names = names if top == 1 else [*names[:-1], names[-1] + "s"]
    else:
        return [*cardinal(top, british), "over", *cardinal(bottom, british)]
    return [*cardinal(top, british), *names]


def money(sign: str, amount: str, scale: str = "", british: bool = False) -> list[str]:
    """Return an amount of money in words.

    Args:
        sign: a key of :data:`CURRENCIES`.
        amount: the number as written.
        scale: *million* and the like, or ``""``.
    """
    one, many, cent, cents = CURRENCIES[sign]
    whole, _, part = amount.replace(",", "").partition(".")
    if scale or (part and (len(part) != 2 or not cents)):
        return [*number(amount, british), *([scale] if scale else []), *many.split()]
    words = [*number(whole or "0", british), *(one if whole == "1" else many).split()]
    if not int(part or 0):
        return words
    small = cardinal(int(part))
    if not int(whole or 0):
        return [*small, cent if small == ["one"] else cents]
    if one == "pound":
        return words + small
    return [*words, "and", *small, cent if small == ["one"] else cents]


def in_singular(sign: str, words: list[str]) -> list[str]:
    """Return an amount as it is said of one thing: *five dollar* of *a $5 note*."""
    one, many, *_ = CURRENCIES[sign]
    single = {many.split()[-1]: one.split()[-1], "cents": "cent"}
    return [single.get(word, word) for word in words]


def time_of_day(hours: int, minutes: int, seconds: int | None = None, half: str = "") -> list[str]:
    """Return a time in words: 10:45 is *ten forty five*, 9:05 *nine oh five*, 7:00 *seven o'clock*.

    Args:
        half: ``"am"``, ``"pm"`` or ``""``.
    """
    words = cardinal(hours)
    if minutes:
        words += ["oh", _ONES[minutes]] if minutes < 10 else cardinal(minutes)
    elif not half:
        words += ["o'clock"] if 0 < hours <= 12 else ["hundred"] if hours > 12 else ["hundred", "hours"]
    if seconds:
        words += ["and", *cardinal(seconds), "second" if seconds == 1 else "seconds"]
    return words + [letter.upper() for letter in half]


_ROMAN = re.compile(r"(XL|L?X{0,3})(IX|IV|V?I{0,3})")


def roman(text: str) -> int:
    """Return the value of a Roman numeral from II to LXXXIX, 0 for anything else."""
    if len(text) < 2 or not _ROMAN.fullmatch(text):
        return 0
    values = [{"I": 1, "V": 5, "X": 10, "L": 50}[c] for c in text]
    return sum(-v if v < max(values[i:]) else v for i, v in enumerate(values))
