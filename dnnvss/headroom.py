"""Whether the limits of this process leave room for the libraries, asked before they would find out.

Where a limit (``ulimit -v``, ``ulimit -d``) stops them while they are loaded or multiply for the first time, torch
aborts, and OpenBLAS ends the process or waits for ever: nothing in Python could tell why. Measured on Linux x86_64.
"""

import os
import sys
from dataclasses import dataclass
from pathlib import Path

from dnnvss.errors import ShortageError

_MEGABYTE = 2**20
_STATUS = Path("/proc/self/status")
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")
"""Variables of the environment that say with how many threads OpenBLAS multiplies, the stronger first."""


@dataclass(frozen=True)
class Limit:
    """What a process may hold of something, and what the libraries take of it.

    Args:
        name: in the module ``resource``.
        held: the row of ``/proc/self/status`` that counts what is held.
        flag: of ``ulimit``, which counts in kilobytes.
        base, thread: megabytes of the libraries, and for each thread of each copy of OpenBLAS.
    """

    name: str
    held: str
    flag: str
    base: int
    thread: int

    def needed(self) -> int:
        """Megabytes of all libraries."""
        return self.base + self.thread * _threads()

    def allowed(self) -> int | None:
        """Megabytes that this process may hold; None where nothing limits it."""
        import resource

        soft, _ = resource.getrlimit(getattr(resource, self.name))
        return None if soft == resource.RLIM_INFINITY else soft // _MEGABYTE


LIMITS = (Limit("RLIMIT_AS", "VmSize", "v", 1000, 240), Limit("RLIMIT_DATA", "VmData", "d", 170, 230))
COPIES, PRODUCTS = 3, 40
"""Copies of OpenBLAS (numpy's, scipy's, OpenCV's), and megabytes that each takes for each thread when it multiplies for
the first time."""


def for_libraries() -> None:
    """Make sure that numpy, scipy, torch and OpenCV can be loaded.

    Raises:
        ShortageError: a limit is too low for them, so that loading one might end the process without a word.
    """
    for limit in _limiting():
        if (allowed := limit.allowed()) is not None and allowed < limit.needed():
            raise _too_low(limit, allowed, limit.needed())


def for_products() -> None:
    """Let every copy of OpenBLAS take its room now, where there is a limit, so that it never asks again.

    Raises:
        ShortageError: a limit is too low for that.
    """
    bound = False
    for limit in _limiting():
        if (allowed := limit.allowed()) is None:
            continue
        bound, needed = True, _held(limit.held) + COPIES * PRODUCTS * _threads()
        if allowed < needed:
            raise _too_low(limit, allowed, needed)
    if bound:
        import cv2
        import numpy as np
        from scipy.linalg import blas

        square = np.eye(256)
        square = blas.dgemm(1.0, square @ square, square)  # scipy's own solve asks none of it for a diagonal matrix
        cv2.solve(square, square, flags=cv2.DECOMP_SVD)
        cv2.gemm(square, square, 1.0, square, 0.0)


def _limiting() -> tuple[Limit, ...]:
    return LIMITS if sys.platform == "linux" and _STATUS.exists() else ()


def _held(row: str) -> int:
    """Megabytes that this process holds."""
    lines = _STATUS.read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(f"{row}:")) // 1024


def _threads() -> int:
    """Threads of a copy of OpenBLAS: as asked for, at most one a core."""
    cores = len(os.sched_getaffinity(0))
    asked = next((os.environ[name] for name in _THREADS if os.environ.get(name, "").isdecimal()), str(cores))
    return max(1, min(cores, int(asked)))


def _too_low(limit: Limit, allowed: int, needed: int) -> ShortageError:
    return ShortageError(
        f"the system is short of what the work needs: this process may hold {allowed} MB (ulimit -{limit.flag}), and "
        f"the libraries alone take {needed} MB",
        remedy=f"Allow more (ulimit -{limit.flag} unlimited, or {needed * 2 * 1024}), or fewer threads "
               f"(OMP_NUM_THREADS=1), then run the same command again: it resumes")
