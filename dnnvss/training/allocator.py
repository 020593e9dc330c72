"""Freed memory stays with the process during a fit."""

import ctypes
import platform

_M_TRIM_THRESHOLD, _M_MMAP_MAX = -1, -4  # malloc.h of glibc


def keep_freed_memory() -> bool:
    """Ask the C library to reuse large blocks instead of returning them; tell whether it will.

    Each gradient of a wide layer is a block of tens of MB. By default glibc hands it back to the kernel after every
    step, and the next step pays for clean pages again: 20 to 75 % of a step. Other libraries are left as they are.
    """
    if platform.libc_ver()[0] != "glibc":
        return False
    libc = ctypes.CDLL(None)
    return bool(libc.mallopt(_M_MMAP_MAX, 0)) and bool(libc.mallopt(_M_TRIM_THRESHOLD, 2**31 - 1))
