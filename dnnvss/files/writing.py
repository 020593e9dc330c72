"""Text, JSON and arrays as every reader takes them, in files that are whole or absent."""

import json
import zipfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from dnnvss.files.whole import replacing


def write_text(path: str | Path, text: str) -> Path:
    """Write ``text`` as UTF-8 and return the path; bytes of names that are not UTF-8 are escaped (``caf\\xe9``)."""
    with replacing(path) as temporary:
        temporary.write_text(printable(text), encoding="utf-8")
    return Path(path)


def as_utf8(text: str) -> str:
    """A text of the command line as UTF-8 where the system's locale took its bytes for something else."""
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        try:
            return text.encode("utf-8", "surrogateescape").decode("utf-8")
        except UnicodeError:
            return text
    return text


def printable(text: str) -> str:
    """A text in which bytes of file names that are no UTF-8 stand as escapes, as in ``caf\\xe9``."""
    try:
        return text.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
    except UnicodeEncodeError:  # halves of a pair of UTF-16, which no name holds
        return text.encode("utf-8", "backslashreplace").decode("utf-8")


def write_json(path: str | Path, value: Any) -> Path:
    """Write ``value`` as indented JSON and return the path; numbers that are not finite become ``null``."""
    return write_text(path, json_text(value, indent=2) + "\n")


def json_text(value: Any, **layout: Any) -> str:
    """A value as JSON that every reader takes, laid out as :func:`json.dumps` is told."""
    text = json.dumps(_finite(value), ensure_ascii=False, allow_nan=False, **layout)
    if text.isascii() or text == text.encode("utf-8", "replace").decode("utf-8"):
        return text
    return json.dumps(_finite(value), allow_nan=False, **layout)  # names that are not UTF-8 keep their bytes


def _finite(value: Any) -> Any:
    """Plain containers in which None stands for NaN and for infinite numbers, which JSON does not have."""
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


@dataclass(frozen=True)
class Rows:
    """An array that is written part by part, so that one part at a time is in memory.

    Args:
        shape: of the whole.
        dtype: of its values.
        parts: rows of it, in order.
    """

    shape: tuple[int, ...]
    dtype: Any
    parts: Iterable[np.ndarray]


def write_arrays(path: str | Path, /, **arrays: Any) -> Path:
    """Write named arrays, whatever their names, or :class:`Rows`, as an uncompressed ``.npz`` and return the path."""
    with replacing(path) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_STORED) as archive:
        for name, value in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                if isinstance(value, Rows):
                    _write_rows(member, value)
                else:
                    np.lib.format.write_array(member, np.asanyarray(value), allow_pickle=False)
    return Path(path)


def _write_rows(member: IO[bytes], rows: Rows) -> None:
    descr = np.lib.format.dtype_to_descr(np.dtype(rows.dtype))
    np.lib.format.write_array_header_1_0(member, {"descr": descr, "fortran_order": False, "shape": rows.shape})
    for part in rows.parts:
        member.write(np.ascontiguousarray(part, rows.dtype).data)
