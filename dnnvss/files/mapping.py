"""Arrays that lie in files without a name, and in memory only where they are used."""

import mmap
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError


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
