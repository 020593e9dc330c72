"""Errors that say what the system lacks, and nothing of the file that was being read or written."""

import errno
from collections.abc import Iterator

from dnnvss.errors import ShortageError

MEMORY = "Close other programs or run fewer side by side (jobs=1), then run the same command again: it resumes"
"""What to do where memory is short."""
_HANDLES = "Allow more open files (ulimit -n 4096) or run fewer side by side (jobs=1), then run the same command again"
_PROCESSES = "Allow more processes (ulimit -u) or run fewer side by side (jobs=1), then run the same command again"
_REMEDIES = {errno.EMFILE: _HANDLES, errno.ENFILE: _HANDLES, errno.ENOMEM: MEMORY, errno.EAGAIN: _PROCESSES,
             errno.ENOBUFS: MEMORY}
_WORDS = {"can't allocate memory": MEMORY, "out of memory": MEMORY, "insufficient memory": MEMORY,
          "cannot allocate memory": MEMORY, "failed to map segment": MEMORY, "too many open files": _HANDLES,
          "can't start new thread": _PROCESSES}
"""What libraries say that have no kind of error for it (torch, OpenCV, the loader of shared libraries)."""


def shortage_of(error: BaseException, file: object = None) -> ShortageError | None:
    """The shortage behind an error, or behind one that it follows from; None where it is something else.

    Args:
        error: of any library.
        file: what was being read or written, for the message.
    """
    for cause in _causes(error):
        if isinstance(cause, ShortageError):
            return cause
        remedy = _remedy(cause)
        if remedy is not None:
            what = "memory is too small" if isinstance(cause, MemoryError) else _said(cause)
            doing = f" (at {file})" if file is not None else ""
            return ShortageError(f"the system is short of what the work needs: {what}{doing}", remedy=remedy)
    return None


def _remedy(error: BaseException) -> str | None:
    if isinstance(error, MemoryError):
        return MEMORY
    if isinstance(error, OSError) and error.errno in _REMEDIES:
        return _REMEDIES[error.errno]
    if isinstance(error, (OSError, RuntimeError, ImportError)) or type(error).__module__.startswith("cv2"):
        said = str(error).lower()
        return next((remedy for words, remedy in _WORDS.items() if words in said), None)
    return None


def _said(error: BaseException) -> str:
    return getattr(error, "strerror", None) or str(error).strip().splitlines()[0]


def _causes(error: BaseException) -> Iterator[BaseException]:
    """An error and those that it followed from, the last first."""
    seen: set[int] = set()
    left: BaseException | None = error
    while left is not None and id(left) not in seen:
        seen.add(id(left))
        yield left
        left = left.__cause__ or left.__context__
