# ruff: noqa: RUF001  (signs that look like others are what this is about)
"""Text that went through a wrong decoding or was escaped for a program, as it was written."""

import re


def _sign(byte: int) -> str:
    """The sign that Windows shows for a byte; control characters stand for those that it has none for."""
    return bytes([byte]).decode("cp1252", "ignore") or chr(byte)


_BEHIND = {sign: byte for byte in range(0x80, 0xC0) for sign in (_sign(byte), chr(byte))}
"""Signs that stand for the bytes behind the first one of a sign in UTF-8."""
_CLASS = "[" + re.escape("".join(_BEHIND)) + "]"
_TWICE = re.compile(rf"(?<![A-ZÀ-Þ])[ÂÃÄÅ]{_CLASS}|â[€‚„\x80\x82\x84]{_CLASS}")
"""Letters of Latin alphabets, and signs of print, in UTF-8 that was read as cp1252 or Latin-1: ``â€™``, ``Ã©``."""
_QUOTE = re.compile(r"â€\x9d?")
"""A closing quote: Windows has no sign for its last byte."""
_LINE = re.compile(r"(?:\\r)?\\n|\\[rt]")
"""Ends of lines and tabs as programs write them; in the path of a file they are the start of a name."""
_PATH = re.compile(r"(?:\b[A-Za-z]:|\\)\\")
_ESCAPED = re.compile(r"\\(?:(['\"])|u([0-9a-fA-F]{4}))")


def mended(text: str) -> str:
    """Return a text in which what was UTF-8 read as cp1252 (``itâ€™s``) and what a program escaped (``it\\'s``,
    ``\\u2019``, ``\\n``) are the signs that were meant.
    """
    if "\\" in text:
        if not _PATH.search(text):
            text = _LINE.sub(lambda m: " " if m[0] == "\\t" else "\n", text)
        text = _ESCAPED.sub(lambda m: m[1] or chr(int(m[2], 16)), text)
    if text.isascii():
        return text
    return _QUOTE.sub("\u201d", _TWICE.sub(_once, text))


def _once(match: re.Match[str]) -> str:
    """The sign of two or three that stand for its bytes."""
    data = bytes(_BEHIND.get(sign, ord(sign) if ord(sign) < 256 else 0) for sign in match[0])
    return data.decode("utf-8", "ignore") or match[0]
