"""Dates whose order is told, written so that they are read in that order."""

import re
from itertools import accumulate, pairwise

from dnnvss.text.quantities import MONTHS


def in_order(text: str, form: str) -> str:
    """A date of numbers as year-month-day, or as month and day or year; the text itself where it is none.

    Args:
        text: numbers with signs between them, or as many digits as the format has letters.
        form: the order, as ``dmy``, ``my``, ``y`` or ``yyyymmdd``.
    """
    if re.fullmatch(r"\s*\?{4}\d{4}\s*", text):
        text, form = text.strip().strip("?"), "mmdd"  # a day of any year
    runs = [run[0] for run in re.finditer(r"(y+|m+|d+)", form)]
    parts = re.findall(r"\d+", text)
    if len(parts) == 1 and len(runs) > 1 and len(parts[0]) == len(form):
        edges = [0, *accumulate(map(len, runs))]
        parts = [parts[0][a:b] for a, b in pairwise(edges)]
    if len(parts) != len(runs) or re.search(r"[^\W\d_]", text):
        return text
    field = {run[0]: int(part) for run, part in zip(runs, parts, strict=True)}
    year, month, day = (field.get(name) for name in "ymd")
    if month is not None and not 1 <= month <= 12:
        return text
    if year is not None and year < 100:
        year += 2000 if year < 50 else 1900
    if year is not None and month and day:
        return f"{year:04d}-{month:02d}-{day:02d}"
    named = MONTHS[month - 1].capitalize() if month else ""
    return f"{named} {day or year}".strip() if (day or year) is not None else named
