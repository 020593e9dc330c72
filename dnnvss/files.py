"""Files that are whole or absent: every output is written to a temporary name and moved into place."""

import codecs
import errno
import hashlib
import json
import mmap
import os
import re
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import IO, Any

import numpy as np

from dnnvss import staging
from dnnvss.errors import DnnvssError
from dnnvss.shortages import shortage_of
from dnnvss.staging import FileSet, Part, current

_FULL = "Free some space or choose another folder, then run the same command again: it resumes"
_CLOSED = "Choose another place, or give yourself the right to use this one"
_REMEDIES = {errno.ENOSPC: _FULL, errno.EDQUOT: _FULL, errno.EFBIG: _FULL, errno.EACCES: _CLOSED, errno.EPERM: _CLOSED,
             errno.EROFS: _CLOSED, errno.EISDIR: _CLOSED, errno.ENOTDIR: _CLOSED,
             errno.ENAMETOOLONG: "Choose a shorter name",
             errno.ELOOP: "It is a link that leads to itself: name the file"}


def remedy_for(error: OSError) -> str | None:
    """Return what to do about an error of the system that is no fault of the program, None for any other."""
    return _REMEDIES.get(error.errno or 0)


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path beside ``path``, with its suffix; it is moved to ``path`` when the block ends well.

    If the block raises (Ctrl-C included) the temporary file is removed and ``path`` is left as it was. What a killed
    process left beside it is removed. Within :func:`together` the move comes with those of the whole set.

    Raises:
        DnnvssError: the disk is full or the folder cannot be written.
    """
    path = Path(path)
    part: Part | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part = Part.begin(path)
        part.file.chmod(0o644)
        yield part.file
        if (group := current.get()) is not None:
            group.add(part)
            part = None
        else:
            part.move()
    except OSError as error:
        if part is not None and _is_of_another(error, (part.file, path, path.parent)):
            raise  # the block names that file better
        raise _unwritten(path, error) from error
    finally:
        if part is not None:
            part.discard()


@contextmanager
def locked(path: str | Path, waiting: str = "") -> Iterator[None]:
    """Hold the lock that belongs to a path, as :func:`dnnvss.staging.locked` does.

    Raises:
        DnnvssError: the folder cannot be written.
    """
    with ExitStack() as stack:
        try:
            stack.enter_context(staging.locked(Path(path), waiting))
        except OSError as error:
            raise _unwritten(Path(path), error) from error
        yield


@contextmanager
def together(mark: str | Path) -> Iterator[FileSet]:
    """Let all files that the block writes come to be at its end, or none of them: they belong together.

    Two processes that write one set end with one whole set: a lock beside the mark is held while files are moved.

    Args:
        mark: the file that says that the set is whole; it goes first and comes last.

    Raises:
        DnnvssError: a file cannot be put in its place.
    """
    group = FileSet(Path(mark))
    token = current.set(group)
    try:
        yield group
        current.reset(token)
        try:
            group.move()
        except OSError as error:
            raise _unwritten(Path(error.filename2 or error.filename or mark), error) from error
    finally:
        if current.get() is group:
            current.reset(token)
        group.discard()


def _unwritten(path: Path, error: OSError) -> DnnvssError:
    """What is said of a file that the system does not let be written."""
    if (short := shortage_of(error, path)) is not None:
        return short
    return DnnvssError(f"cannot be written ({error.strerror or error})", file=path,
                       remedy=remedy_for(error) or _CLOSED)


def inside(folder: Path, name: str) -> Path:
    """The path of a file that another file names, which must lie in ``folder``.

    Raises:
        DnnvssError: the name leads out of the folder: it is absolute, has ``..``, or goes through a link; or no system
            has files of such a name.
    """
    check_name(name, folder)
    path = folder / name
    if not path.resolve().is_relative_to(folder.resolve()):
        raise DnnvssError(f"{name!r} is a link that leads out of the folder", file=folder, remedy=_STRANGE)
    return path


def check_name(name: str, folder: Path) -> None:
    """Refuse the name of a file that leads out of ``folder`` or that some system cannot have; links are not looked at.

    Raises:
        DnnvssError: it is empty or absolute, has ``..`` or a backslash, or means a device.
    """
    parts = PurePosixPath(name).parts
    odd = not parts or PurePosixPath(name).is_absolute() or PureWindowsPath(name).drive or ".." in parts
    odd = odd or any(len(part.encode(errors="replace")) > _LONGEST or _DEVICES.fullmatch(part) for part in parts)
    if odd or "\\" in name or any(ord(c) < 32 for c in name):
        raise DnnvssError(f"the name {name!r} leads out of the folder", file=folder, remedy=_STRANGE)


_STRANGE = "Do not use these files unless you know who wrote them; put the file itself into the folder"
_LONGEST = 240  # bytes of a part of a name; systems allow 255, and temporary files have longer names
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)
"""Names that mean devices on Windows."""


def check_apart(written: Sequence[Path], read: Sequence[Path]) -> None:
    """Refuse what would be written over a file that is read, links followed, or twice.

    Raises:
        DnnvssError: there is such a file.
    """
    places = [path.resolve() for path in written]
    for path in read:
        if path.resolve() in places:
            raise DnnvssError("is read, and would be written over", file=path, remedy="Give the output another name")
    for place in places:
        if places.count(place) > 1:
            raise DnnvssError("two outputs have this name", file=place, remedy="Name one of them otherwise")


def make_folder(path: str | Path) -> Path:
    """A folder that is there when this returns, with those above it.

    Raises:
        DnnvssError: it cannot be made, or a file has its name.
    """
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DnnvssError(f"cannot be made ({error.strerror or error})", file=path, remedy=_CLOSED) from error
    return Path(path)


def remove(path: str | Path) -> None:
    """Remove a file, if it is there.

    Raises:
        DnnvssError: it is there and cannot be removed.
    """
    try:
        Path(path).unlink(missing_ok=True)
    except OSError as error:
        raise DnnvssError(f"cannot be removed ({error.strerror or error})", file=path,
                          remedy=remedy_for(error) or _CLOSED) from error


def _is_of_another(error: OSError, ours: tuple[Path, ...]) -> bool:
    """Whether an error names files, and none of ours; a copy that fails names what it reads and what it writes."""
    named = {Path(os.fsdecode(name)) for name in (error.filename, error.filename2) if name is not None}
    return bool(named) and not named & set(ours)


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


def write_arrays(path: str | Path, **arrays: Any) -> Path:
    """Write named arrays, or :class:`Rows`, as an uncompressed ``.npz`` and return the path."""
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


def mapped(parts: Iterable[np.ndarray], folder: str | Path) -> np.ndarray:
    """Return arrays (N, ...) joined along their first axis, mapped from a file without a name in ``folder``.

    They are written as they come, so that one of them at a time need be in memory; afterwards the system keeps what is
    used and may drop the rest. The file is gone when the array is.

    Raises:
        DnnvssError: the disk is full or the folder cannot be written.
    """
    rows, shape, dtype = 0, (0,), np.dtype(np.float32)
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            for part in parts:
                file.write(np.ascontiguousarray(part).data)
                rows, shape, dtype = rows + len(part), part.shape[1:], part.dtype
            file.flush()
            if not rows:
                return np.zeros((0, *shape), dtype)
            # A plain view of the map: the subclass np.memmap makes each small index slower.
            return np.asarray(np.memmap(file, dtype, "r+", shape=(rows, *shape)))
    except OSError as error:
        raise DnnvssError(f"cannot hold {rows} rows and more ({error.strerror or error})", file=Path(folder),
                          remedy="Free some space or choose another folder") from error


def forget(array: np.ndarray) -> None:
    """Give the memory of an array back that is mapped from a file (:func:`mapped`), or of a part of one.

    What it holds stays in the file and comes back when it is looked at. Other arrays are left alone.
    """
    base: Any = array
    while isinstance(base, np.ndarray):
        base = base.base
    if not isinstance(base, mmap.mmap) or not array.flags.c_contiguous or not hasattr(mmap, "MADV_DONTNEED"):
        return
    begin = array.ctypes.data - np.frombuffer(base, np.uint8).ctypes.data
    first = -(-begin // mmap.PAGESIZE) * mmap.PAGESIZE  # pages that others share stay
    length = (begin + array.nbytes) // mmap.PAGESIZE * mmap.PAGESIZE - first
    if length > 0:
        base.madvise(mmap.MADV_DONTNEED, first, length)


def shared(parts: Sequence[np.ndarray]) -> np.ndarray | None:
    """Return the array of which ``parts`` are consecutive slices along the first axis, from the first to the last.

    None where they are not: then they have to be joined.
    """
    filled = [part for part in parts if part.size]
    if not filled:
        return None
    first, place = filled[0], filled[0].ctypes.data
    for part in filled:
        inside = part.base is not None and part.base is first.base
        if not inside or not part.flags.c_contiguous or part.dtype != first.dtype or part.ctypes.data != place:
            return None
        place += part.nbytes
    rows = sum(len(part) for part in parts)
    return np.lib.stride_tricks.as_strided(first, (rows, *first.shape[1:]))


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
    """What text is encoded in: UTF-8, UTF-16 and UTF-32, with or without a byte order mark, else what Windows writes.

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
        if not _NO_TEXT.search(data) and above <= max(1, 0.3 * len(data)):
            return "cp1252"
    return "utf-8-sig"


_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f\x7f]")
"""Characters that no editor writes."""
_NO_TEXT = re.compile(rb"[\x00-\x08\x0b\x0c\x0e-\x19\x1b-\x1f\x7f\x81\x8d\x8f\x90\x9d]")
"""Control characters, and bytes that mean nothing in cp1252."""


def read_json(path: str | Path, remedy: str = "Write the file again") -> Any:
    """Return the value in a JSON file."""
    return read(path, lambda p: json.loads(read_text(p, remedy)), remedy)
