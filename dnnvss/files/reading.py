"""Files of others, read or refused with what to do."""

import codecs
import hashlib
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from dnnvss.errors import DnnvssError
from dnnvss.shortages import shortage_of

_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f\x7f]")
"""Characters that no editor writes."""
_MAC = re.compile(rb"[A-Za-z]\xd5[a-z]|(?:^|[\s(])\xd2[\x00-\x7f\x8e\xd5]+\xd3")
"""An apostrophe within a word, or quotes around some, as Mac OS wrote them before it knew Unicode."""
_NO_MAC = re.compile(rb"[\x00-\x08\x0b\x0c\x0e-\x19\x1b-\x1f\x7f\x85\x91-\x97]")
"""Control characters, and the quotes and dashes of Windows."""
_NO_TEXT = re.compile(rb"[\x00-\x08\x0b\x0c\x0e-\x19\x1b-\x1f\x7f\x81\x8d\x8f\x90\x9d]")
"""Control characters, and bytes that mean nothing in cp1252."""


def read(path: str | Path, reader: Callable[[Path], Any], remedy: str) -> Any:
    """Return ``reader(path)``; a missing or damaged file becomes an error that says what to do.

    Raises:
        DnnvssError: the file is missing, cut short or not of its kind.
    """
    path = Path(path)
    if not path.is_file():
        raise DnnvssError("no such file", file=path, remedy=remedy)
    try:
        return reader(path)
    except DnnvssError:
        raise
    except Exception as error:  # each format fails in its own way; all of them mean the same to the user
        if (short := shortage_of(error, path)) is not None:
            raise short from error
        if not path.is_file():
            raise DnnvssError("was removed by another command while it was read", file=path, remedy=remedy) from error
        if path.stat().st_size == 0:
            raise DnnvssError("is empty, not a byte of it is there", file=path, remedy=remedy) from error
        said = " ".join(f"{type(error).__name__}: {error}".split())[:300]
        raise DnnvssError(f"cannot be read ({said})", file=path, remedy=remedy) from error


def digest(path: str | Path) -> str:
    """The SHA-256 of what a file holds, in hexadecimal digits."""
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def read_text(path: str | Path, remedy: str) -> str:
    """The text in a file, whichever encoding its editor chose (:func:`text_encoding`); lines end in ``\\n``.

    Raises:
        DnnvssError: the file is missing, in another encoding, or holds control characters; names the first byte or
            character that does not fit and its line.
    """
    path = Path(path)
    data: bytes = read(path, Path.read_bytes, remedy)
    try:
        text = data.decode(text_encoding(data))
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise DnnvssError(f"line {line}: byte {error.start} ({data[error.start]:#04x}) is no {error.encoding}",
                          file=path, remedy="Save it as UTF-8") from error
    text = text.replace("\r\n", "\n").replace("\r", "\n").rstrip("\x1a")
    if control := _CONTROL.search(text):
        line = text.count("\n", 0, control.start()) + 1
        raise DnnvssError(f"line {line}: U+{ord(control[0]):04X} is a control character, and this is no text",
                          file=path, remedy="Save it as plain text, UTF-8")
    return text


def text_encoding(data: bytes) -> str:
    """What text is encoded in: UTF-8, UTF-16 and UTF-32, with or without a byte order mark, else what Windows writes,
    or old Macs, told by their quotes.

    ``cp1252`` is told from what is no text by its signs: it has no control characters, and most letters are ASCII.
    """
    if data.startswith((codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE)):
        return "utf-32"
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    if b"\0" in data[:2]:
        return "utf-16-be" if data[0] == 0 else "utf-16-le"
    high, low = data[::2].count(0), data[1::2].count(0)
    if max(high, low) > len(data) // 8 and not min(high, low):  # the first letter is none of ASCII
        return "utf-16-be" if high else "utf-16-le"
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        above = len(data.translate(None, bytes(range(128))))
        if above <= max(1, 0.3 * len(data)):
            if _MAC.search(data) and not _NO_MAC.search(data):
                return "mac_roman"
            if not _NO_TEXT.search(data):
                return "cp1252"
    return "utf-8-sig"


def read_json(path: str | Path, remedy: str = "Write the file again") -> Any:
    """Return the value in a JSON file."""
    return read(path, lambda p: json.loads(read_text(p, remedy)), remedy)
