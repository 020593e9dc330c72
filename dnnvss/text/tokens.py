"""What normalisation yields: pieces of the text with the words that are said for them."""

from dataclasses import dataclass, replace
from functools import lru_cache
from importlib.resources import files as package_files

BREAKS = ("none", "minor", "major")


@dataclass(frozen=True)
class Token:
    """A piece of the text and how it is said.

    Args:
        written: the piece as it stands in the text.
        words: what is said, in lower case; a single capital is the name of that letter; none before a pause that the
            text begins with.
        brk: the break after it: ``none``, ``minor`` (comma, dash) or ``major`` (end of a sentence).
        phones: phones given in the text itself, else None; then there is one word.
        emphasis: the text emphasises it.
        pause: seconds of a pause that the text asks for after it, None if it does not.
        doubt: what is uncertain about the reading, empty if nothing.
        rate: how fast the text asks for it, 1 as usual.
    """

    written: str
    words: tuple[str, ...]
    brk: str = "none"
    phones: tuple[str, ...] | None = None
    emphasis: bool = False
    pause: float | None = None
    doubt: str = ""
    rate: float = 1.0

    def broken(self, brk: str, pause: float | None = None) -> "Token":
        """Return the token with at least that break, and with a pause where one is given."""
        stronger = max(self.brk, brk, key=BREAKS.index)
        return replace(self, brk=stronger, pause=self.pause if pause is None else pause)


def word_list(text: str) -> tuple[str, ...]:
    """Return the words of a row."""
    return tuple(text.split())


def word_set(text: str) -> frozenset[str]:
    """Return the words of a row as a set."""
    return frozenset(text.split())


@lru_cache(maxsize=8)
def table(name: str) -> dict[str, tuple[str, ...]]:
    """Return a table of the folder ``data``: first column to the other columns; lines with ``# `` are comments."""
    text = (package_files("dnnvss.text") / "data" / f"{name}.tsv").read_text(encoding="utf-8")
    rows = (line.split("\t") for line in text.splitlines() if line and not line.startswith("# "))
    return {first: tuple(rest) for first, *rest in rows}
