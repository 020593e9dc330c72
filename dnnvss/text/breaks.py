"""Which words of a text are followed by punctuation that ends a phrase."""

import re

_PIECE = re.compile(r"[^\W_]+(?:['\u2019][^\W_]+)*['\u2019]?|[,;:.!?\u2026\u2013\u2014()]|(?<=\s)-+(?=\s)|--+")


def words_and_breaks(text: str) -> list[tuple[str, bool]]:
    """Return each word of a text in lower case, and whether the punctuation after it ends a phrase."""
    found: list[tuple[str, bool]] = []
    for piece in _PIECE.findall(text):
        if piece[0].isalnum():
            found.append((piece.lower().replace("\u2019", "'"), False))
        elif found:
            found[-1] = (found[-1][0], True)
    return found
