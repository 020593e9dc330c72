"""Tables as Markdown and as aligned text for the screen."""

from collections.abc import Iterable, Sequence


def markdown_table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table of texts: a head and its rows, cells left aligned."""
    return _lines(head, ["---"] * len(head), rows)


def markdown_numbers(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table of numbers: the first column names the row, the others are right aligned."""
    return _lines(head, ["---"] + ["---:"] * (len(head) - 1), rows)


def aligned(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """The same as text for the screen, the first column left and the others right aligned, under a rule of dashes."""
    widths = [max(len(row[i]) for row in [head, *rows]) for i in range(len(head))]
    lines = []
    for row in [head, ["-" * w for w in widths], *rows]:
        cells = [c.rjust(w) for c, w in zip(row, widths, strict=True)]
        lines.append("  ".join([row[0].ljust(widths[0]), *cells[1:]]))
    return "\n".join(lines)


def _lines(head: Sequence[str], rule: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    return "\n".join("| " + " | ".join(map(str, cells)) + " |" for cells in [head, rule, *rows])
