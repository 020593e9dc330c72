"""The three ways in which Praat writes a TextGrid: long text, short text, binary."""

import re
import struct
from collections.abc import Iterator
from typing import NamedTuple

from dnnvss.formats.numbers import number

BINARY = b"ooBinaryFile\x08TextGrid"
"""How a binary TextGrid begins."""

_TOKEN = re.compile(r'"((?:[^"]|"")*)"|(?<!\S)([-+]?\d[\d.]*(?:e[-+]?\d+)?)(?!\S)|(?<!\S)<(\w+)>|(?<!\S)![^\n]*',
                    re.IGNORECASE)


class CutShortError(ValueError):
    """A file that ends before what it announces."""


class PraatTier(NamedTuple):
    """A tier of intervals.

    Args:
        name: as written.
        rows: start and end in seconds, and label, of each interval.
    """

    name: str
    rows: list[tuple[float, float, str]]


class PraatGrid(NamedTuple):
    """A TextGrid without its tiers of points.

    Args:
        end: seconds at which it ends.
        tiers: of intervals.
    """

    end: float
    tiers: list[PraatTier]


def parse_text(text: str) -> PraatGrid:
    """A TextGrid in Praat's long or short text.

    As in Praat, only texts in quotes, numbers that stand alone and ``<exists>`` count; all else is comment.

    Raises:
        ValueError: it is none, or is cut short.
    """
    tokens = _Tokens(text)
    if "ooTextFile" not in text[:200]:
        raise ValueError("it does not begin as a TextGrid does")
    if not tokens.text().startswith("ooTextFile") or tokens.text() != "TextGrid":
        raise ValueError("it does not begin as a TextGrid does")
    tokens.number()
    end = tokens.number()
    if tokens.flag() != "exists":
        return PraatGrid(end, [])
    tiers = []
    for _ in range(int(tokens.number())):
        kind, name, _, _ = tokens.text(), tokens.text(), tokens.number(), tokens.number()
        count = int(tokens.number())
        if kind == "IntervalTier":
            tiers.append(PraatTier(name, [(tokens.number(), tokens.number(), tokens.text()) for _ in range(count)]))
        else:
            for _ in range(count):
                tokens.number(), tokens.text()
    return PraatGrid(end, tiers)


class _Tokens:
    """What counts in a text of Praat's, one after the other."""

    def __init__(self, text: str) -> None:
        self._found: Iterator[re.Match[str]] = (m for m in _TOKEN.finditer(text) if any(m.groups()) or m[1] == "")

    def _next(self, group: int) -> str:
        match = next(self._found, None)
        if match is None:
            raise CutShortError("it is cut short")
        if match[group] is None:
            raise ValueError(f"{match[0][:40]} stands where a {('text', 'number', 'flag')[group - 1]} should")
        return match[group]

    def text(self) -> str:
        return self._next(1).replace('""', '"')

    def number(self) -> float:
        return number(self._next(2))

    def flag(self) -> str:
        return self._next(3)


def parse_binary(data: bytes) -> PraatGrid:
    """A TextGrid in Praat's binary form.

    Raises:
        ValueError: it is none, or is cut short.
    """
    if not data.startswith(BINARY):
        raise ValueError("it does not begin as a binary TextGrid does")
    stream = _Bytes(data, len(BINARY))
    _, end, exists = stream.take(">dd?")
    tiers = []
    for _ in range(stream.take(">i")[0] if exists else 0):
        kind = stream.name()
        name = stream.text()
        *_, count = stream.take(">ddi")
        if kind == "IntervalTier":
            tiers.append(PraatTier(name, [(*stream.take(">dd"), stream.text()) for _ in range(count)]))
        else:
            for _ in range(count):
                stream.take(">d"), stream.text()
    return PraatGrid(float(end), tiers)


class _Bytes:
    """Big-endian values, one after the other."""

    def __init__(self, data: bytes, at: int) -> None:
        self._data, self._at = data, at

    def take(self, form: str) -> tuple:
        size = struct.calcsize(form)
        if self._at + size > len(self._data):
            raise CutShortError("it is cut short")
        found = struct.unpack_from(form, self._data, self._at)
        self._at += size
        return found

    def name(self) -> str:
        (size,) = self.take(">B")
        return bytes(self.take(f">{size}s")[0]).decode("ascii")

    def text(self) -> str:
        """A text: bytes of Latin-1 behind their number, or, behind -1, a number of units of UTF-16."""
        (size,) = self.take(">H")
        if size != 0xFFFF:
            return bytes(self.take(f">{size}s")[0]).decode("latin-1")
        (size,) = self.take(">H")
        return bytes(self.take(f">{2 * size}s")[0]).decode("utf-16-be")
