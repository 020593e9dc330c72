"""A user's own dictionary."""

from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError


def read_overrides(path: str | Path) -> dict[str, str]:
    """Return the pronunciations in a dictionary file: word in lower case to phones.

    Each line holds a word and its phones, ``WORD PH PH ...``; empty lines and lines that begin with ``#`` or ``;`` are
    passed over. The phones themselves are checked where they are used.

    Raises:
        DnnvssError: the file is missing, or a line has no phones; the message gives its number.
    """
    remedy = "Write a word and its ARPAbet phones on each line, e.g. GRID G R IH D"
    lines = files.read(path, lambda p: p.read_text(encoding="utf-8").splitlines(), remedy)
    found = {}
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.lstrip()[0] in "#;":
            continue
        word, _, phones = line.strip().partition(" ")
        if not phones.strip():
            raise DnnvssError(f"line {number}: {line.strip()!r} has no phones", file=path, remedy=remedy)
        found[word.lower()] = phones.strip()
    return found
