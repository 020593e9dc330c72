"""Tables as spreadsheets of any country write them: parted by commas, semicolons or tabs."""

import csv
import re
from collections.abc import Callable

from dnnvss.formats.numbers import comma_number, number

Rows = list[tuple[int, list[str]]]
"""Number of a line, from 1, and its cells without the blanks around them."""


def table_rows(text: str) -> tuple[Rows, Callable[[str], float]]:
    """The rows of a table that are not blank, and what reads a number of it.

    The sign that parts cells is the one that the first row has most often, or that Excel names in a first line
    ``sep=;``. Where that is no comma, numbers may have one before their decimals.
    """
    lines = text.split("\n")
    named = re.fullmatch(r"\s*sep=(.)\s*", lines[0])
    first = 1 if named else 0
    head = next((line for line in lines[first:] if line.strip()), "")
    sign = named[1] if named else max((",", ";", "\t"), key=head.count)
    paired = all(line.count('"') % 2 == 0 for line in lines[first:])  # else some are signs of a text, behind spaces too
    reader = csv.reader(lines[first:], delimiter=sign, skipinitialspace=paired)
    rows = [(reader.line_num + first, [cell.strip() for cell in row]) for row in reader]
    return [(place, row) for place, row in rows if any(row)], number if sign == "," else comma_number
