"""Temporary files beside what they become: locked while they are written, swept when their process is gone.

A lock of the system's (``flock``) marks a temporary file as being written and ends with its process, however that ends.
A temporary file without one is what a killed command left.
"""

import errno
import os
import re
import secrets
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

fcntl: Any = import_module("fcntl") if os.name == "posix" else None
"""The locks of the system; without them nothing is swept."""
_NAME = re.compile(r"\..*\.[a-z0-9_]{8}\.part(\.[^.]*)?", re.DOTALL)
_SCRATCH, _NEW = "dnnvss.scratch-", 10.0
"""How the names of folders of :func:`scratch` begin, and seconds in which one may have been made and not yet locked."""
_MODE = 0o666
"""Who may read and write what is made: all whom the mask of the process (``umask``) does not shut out."""
_swept: set[tuple[int, Path]] = set()


def is_temporary(name: str) -> bool:
    """Whether a file's name is that of a :class:`Part`."""
    return _NAME.fullmatch(name) is not None


@dataclass(frozen=True)
class Part:
    """A temporary file and what it becomes; its lock lasts until it is moved or discarded.

    Args:
        path: what it becomes.
        file: where it is written, beside ``path`` and with its suffix.
        handle: what holds the lock.
    """

    path: Path
    file: Path
    handle: int

    @classmethod
    def begin(cls, path: Path) -> "Part":
        """A new empty part of ``path``.

        The first call of a process in a folder removes what killed commands left there.

        Raises:
            OSError: the folder cannot be written.
        """
        if (os.getpid(), path.parent) not in _swept:
            _swept.add((os.getpid(), path.parent))
            sweep(path.parent)
        while True:
            file = path.parent.absolute() / f".{path.stem}.{secrets.token_hex(4)}.part{path.suffix}"
            try:
                handle = os.open(file, os.O_RDWR | os.O_CREAT | os.O_EXCL, _MODE)
            except FileExistsError:
                continue
            _lock(handle)
            if os.fstat(handle).st_nlink:  # else another process took it for a leftover before it was locked
                return cls(path, file, handle)
            os.close(handle)

    def move(self) -> None:
        """Move it to where it belongs: the one way in which a file comes to be."""
        move(self.file, self.path)

    def discard(self) -> None:
        """Remove what was not moved, and end the lock."""
        self.file.unlink(missing_ok=True)
        os.close(self.handle)


def move(file: Path, path: Path) -> None:
    """Move a whole file to its name, over what is there."""
    file.replace(path)


@dataclass(frozen=True)
class FileSet:
    """Files that belong together, written and not yet moved.

    Args:
        mark: the one of them that says that the set is whole.
        parts: what was written, by where it belongs.
        gone: older files that have no part in the new set.
    """

    mark: Path
    parts: dict[Path, Part] = field(default_factory=dict)
    gone: set[Path] = field(default_factory=set)

    def add(self, part: Part) -> None:
        """Keep a part that is written until all are."""
        if (older := self.parts.pop(part.path, None)) is not None:
            older.discard()
        self.parts[part.path] = part

    def leave_out(self, path: Path) -> None:
        """Let the new set have no such file: an older one goes when the others are moved."""
        self.gone.add(path)

    def move(self) -> None:
        """Move all of them, the mark last; while they are moved there is no mark.

        Raises:
            OSError: a name that is taken by a folder, or a folder that cannot be written.
        """
        for path in self.parts:
            if path.is_dir():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        with locked(self.mark):
            self.mark.unlink(missing_ok=True)
            for path in self.gone:
                path.unlink(missing_ok=True)
            for path in sorted(self.parts, key=lambda each: each == self.mark):
                self.parts[path].move()

    def discard(self) -> None:
        """Remove what was not moved."""
        for part in self.parts.values():
            part.discard()
        self.parts.clear()


current: ContextVar[FileSet | None] = ContextVar("current", default=None)
"""The set that is being written, if any."""


def is_ours(name: str) -> bool:
    """Whether a file's name is that of a temporary file or of a lock, which come and go beside what is written."""
    return is_temporary(name) or (name.startswith(".") and name.endswith(".lock"))


def sweep(folder: Path) -> list[Path]:
    """Remove the temporary files in a folder that no process is writing; return their names.

    What cannot be removed stays: it comes after everything else.
    """
    removed = []
    with suppress(OSError), os.scandir(folder) as found:
        for entry in list(found):
            if is_temporary(entry.name) and entry.is_file(follow_symlinks=False) and _remove_dead(Path(entry.path)):
                removed.append(Path(entry.path))
    return removed


def sweep_tree(folder: Path) -> None:
    """Sweep a folder and all folders in it."""
    for below, _, names in os.walk(folder):
        if any(map(is_temporary, names)):
            sweep(Path(below))


@contextmanager
def locked(path: Path, waiting: str = "") -> Iterator[None]:
    """Hold the lock that belongs to a path, a hidden file beside it, which is gone afterwards; wait for it first.

    A lock file whose process is gone locks nothing.

    Args:
        path: what is locked; it need not be there.
        waiting: printed where another process holds it.

    Raises:
        OSError: the folder cannot be written.
    """
    lock = path.parent / f".{path.name}.lock"
    while True:
        handle = os.open(lock, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), _MODE)
        _lock(handle, waiting=waiting)
        try:
            if os.path.samestat(os.fstat(handle), lock.lstat()):
                break
        except FileNotFoundError:
            pass
        os.close(handle)  # who held it before has removed the file
    try:
        yield
    finally:
        lock.unlink(missing_ok=True)
        os.close(handle)


@contextmanager
def reading(folder: Path) -> Iterator[None]:
    """Read what is in a folder, others beside; wait for who changes it. One that is not there is left alone."""
    with _used(folder, shared=True, waiting=f"waiting for the command that changes {folder}"):
        yield


@contextmanager
def changing(folder: Path) -> Iterator[None]:
    """Change what is in a folder; wait for those who read it. A folder that is not there yet has no readers."""
    with _used(folder, shared=False, waiting=f"waiting for the commands that read {folder}"):
        yield


@contextmanager
def _used(folder: Path, shared: bool, waiting: str) -> Iterator[None]:
    if not folder.is_dir():
        yield
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        _lock(handle, shared, waiting)
        yield
    finally:
        os.close(handle)


@contextmanager
def scratch() -> Iterator[Path]:
    """A folder for what nobody keeps, in the system's folder for such, gone afterwards.

    The first call of a process removes those of its user's processes that were killed: what people said or brought
    does not stay.
    """
    home = Path(tempfile.gettempdir())
    if (os.getpid(), home) not in _swept:
        _swept.add((os.getpid(), home))
        _sweep_scratch(home)
    with tempfile.TemporaryDirectory(prefix=_SCRATCH, dir=home, ignore_cleanup_errors=True) as name:
        handle = held(Path(name))
        try:
            yield Path(name)
        finally:
            os.close(handle)


def _sweep_scratch(home: Path) -> None:
    """Remove the folders of :func:`scratch` that no process holds, but those that are just being made."""
    if fcntl is None:
        return
    with suppress(OSError), os.scandir(home) as found:
        for entry in list(found):
            if not entry.name.startswith(_SCRATCH) or not entry.is_dir(follow_symlinks=False):
                continue
            told = entry.stat(follow_symlinks=False)
            if told.st_uid == os.getuid() and time.time() - told.st_mtime > _NEW and abandoned(Path(entry.path)):
                shutil.rmtree(entry.path, ignore_errors=True)


def held(folder: Path) -> int:
    """A handle that marks a folder as in use until it is closed or the process ends."""
    handle = os.open(folder, os.O_RDONLY)
    _lock(handle)
    return handle


def abandoned(path: Path) -> bool:
    """Whether no process holds the lock of a file or folder; False where that cannot be told."""
    if fcntl is None:
        return False
    try:
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0))
    except OSError:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    finally:
        os.close(handle)
    return True


def _remove_dead(path: Path) -> bool:
    """Remove a file if no process writes it, under its lock; return whether it is gone."""
    if fcntl is None:
        return False
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
    except OSError:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        path.unlink(missing_ok=True)
    except OSError:
        return False
    finally:
        os.close(handle)
    return True


def _lock(handle: int, shared: bool = False, waiting: str = "") -> None:
    if fcntl is None:
        return
    kind = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
    with suppress(OSError):  # a file system without locks: nothing is swept there
        try:
            fcntl.flock(handle, kind | fcntl.LOCK_NB)
        except BlockingIOError:
            if waiting:
                print(waiting, flush=True)
            fcntl.flock(handle, kind)
