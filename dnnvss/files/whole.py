"""Files that are whole or absent: each is written to a temporary name and moved into its place."""

import errno
import os
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

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


def check_writable(paths: Iterable[Path]) -> None:
    """Refuse outputs that cannot be written, before the work that they are to hold. Nothing is made.

    Raises:
        DnnvssError: one is a folder, or its folder is a file or does not let files be written.
    """
    for path in paths:
        above = next(folder for folder in path.absolute().parents if os.path.lexists(folder))
        number = (errno.EISDIR if path.is_dir() else errno.ENOTDIR if not above.is_dir()
                  else 0 if os.access(above, os.W_OK | os.X_OK) else errno.EACCES)
        if number:
            raise _unwritten(path, OSError(number, os.strerror(number)))


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


def _unwritten(path: Path, error: OSError) -> DnnvssError:
    """What is said of a file that the system does not let be written."""
    if (short := shortage_of(error, path)) is not None:
        return short
    return DnnvssError(f"cannot be written ({error.strerror or error})", file=path,
                       remedy=remedy_for(error) or _CLOSED)


def _is_of_another(error: OSError, ours: tuple[Path, ...]) -> bool:
    """Whether an error names files, and none of ours; a copy that fails names what it reads and what it writes."""
    named = {Path(os.fsdecode(name)) for name in (error.filename, error.filename2) if name is not None}
    return bool(named) and not named & set(ours)
