"""Numbers as files of other tools write them: ASCII digits, finite, of a size that something measured can have."""

import re

LARGEST = 1e15
"""Beyond it a number is a mistake of whoever wrote it."""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.ASCII | re.IGNORECASE)
NO_NUMBER = re.compile(r"[+-]?(nan(\(.*\))?|1[.,]?#\w+|inf(inity)?|n/?a|null|none)?|-"
                       r"|#(n/a|num!|div/0!|value!|ref!|null!)", re.IGNORECASE)
"""What C libraries and tables write for a value that is no number: nan, -nan(ind), 1.#QNAN, NA, #NUM!, nothing."""
_LONGEST = 60  # characters


def number(text: str) -> float:
    """The number that a text is.

    Raises:
        ValueError: it is none, has digits of another script, more than sixty characters, or is beyond all measure.
    """
    text = text.strip()
    if len(text) > _LONGEST or not _NUMBER.fullmatch(text) or not abs(value := float(text)) < LARGEST:
        raise ValueError(f"{text[:_LONGEST]!r} is no number")
    return value


def comma_number(text: str) -> float:
    """The number that a text is, which may have a comma before its decimals; raises as :func:`number` does."""
    return number(text.replace(",", ".") if text.count(",") == 1 and "." not in text else text)


def whole(text: str) -> int:
    """The whole number from 0 that a text is; raises as :func:`number` does."""
    value = number(text)
    if value < 0 or value != int(value):
        raise ValueError(f"{text[:_LONGEST]!r} is no whole number")
    return int(value)
