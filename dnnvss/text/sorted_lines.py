"""A table in a sorted text, a line each, that is looked up where it lies: to read a few words of it costs no table."""

from collections.abc import Iterator, Mapping

MANY = 2000
"""Keys that are looked for one by one; where more are asked for, a table pays."""


class SortedLines(Mapping[str, str]):
    """Lines ``KEY VALUE`` by key; ``KEY(2)``, ``KEY(3)`` stand behind ``KEY``, and the keys themselves are sorted.

    Args:
        text: the lines.
    """

    def __init__(self, text: str) -> None:
        self._text = text.rstrip("\n") + "\n"
        self._known: dict[str, str | None] = {}
        self._whole: dict[str, str | None] | None = None

    def __getitem__(self, key: str) -> str:
        if key not in self._known and self._whole is None:
            if len(self._known) < MANY:
                self._known[key] = self._found(key)
            else:
                self._whole = self._known = dict(self._lines(0))
        value = self._known.get(key)
        if value is None:
            raise KeyError(key)
        return value

    def __iter__(self) -> Iterator[str]:
        return (key for key, _ in self._lines(0))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def _found(self, key: str) -> str | None:
        wanted = _plain(key)
        for own, value in self._lines(self._first(wanted)):
            if own == key:
                return value
            if _plain(own) != wanted:
                break
        return None

    def _first(self, wanted: str) -> int:
        """Where the first line begins whose key does not come before the one that is wanted."""
        text, low, high = self._text, 0, len(self._text)
        while low < high:
            start = text.rfind("\n", low, (low + high) // 2) + 1 or low
            if _plain(text[start : text.find(" ", start)]) < wanted:
                low = text.find("\n", start) + 1
            else:
                high = start
        return low

    def _lines(self, start: int) -> Iterator[tuple[str, str]]:
        """Keys and values from a line on."""
        while start < len(self._text):
            end = self._text.find("\n", start)
            key, space, value = self._text[start:end].partition(" ")
            if space:
                yield key, value
            start = end + 1


def _plain(key: str) -> str:
    """A key without its number."""
    return key[: key.rindex("(")] if key.endswith(")") and "(" in key else key
