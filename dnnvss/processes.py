"""Work shared out to processes that end when the one that started them does."""

import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

_EVERY = 1.0
"""Seconds between two looks at whether the parent still lives."""


@contextmanager
def parallel(jobs: int, backend: str = "loky") -> Iterator[None]:
    """Let joblib's calls in the block run in processes of this machine.

    Args:
        jobs: processes; -1 for all cores.
        backend: of joblib; the workers of ``loky`` watch their parent.
    """
    import joblib  # slow to import, and synthesis needs none of it

    more = {"initializer": end_with_parent} if backend == "loky" else {}
    with joblib.parallel_config(backend=backend, n_jobs=jobs, **more):
        yield


def end_with_parent() -> None:
    """End this process soon after its parent has ended, however that ended.

    A thread looks at the parent's number. The system's own signal (``PR_SET_PDEATHSIG``) would come when the *thread*
    ends that started this process, while the parent still lives.
    """
    parent = os.getppid()
    threading.Thread(target=_watch, args=(parent,), daemon=True, name="end with parent").start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_EVERY)
    os._exit(1)
