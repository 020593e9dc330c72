"""Work shared out to processes that end when the one that started them does."""

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

_EVERY = 1.0
"""Seconds between two looks at whether the parent still lives."""
_PARENT = "DNNVSS_PARENT"
"""The variable of the environment that tells a helper which process it helps."""


@contextmanager
def parallel(jobs: int, backend: str = "loky") -> Iterator[None]:
    """Let joblib's calls in the block run in processes of this machine.

    Args:
        jobs: processes; -1 for all cores.
        backend: of joblib; the workers of ``loky`` watch their parent.
    """
    import joblib  # slow to import, and synthesis needs none of it

    more = {"initializer": end_with_parent, "initargs": (os.getpid(),)} if backend == "loky" else {}
    with joblib.parallel_config(backend=backend, n_jobs=jobs, **more):
        yield


def name_parent() -> None:
    """Tell the processes that this one will start who their parent is: see :func:`end_with_parent`."""
    os.environ[_PARENT] = str(os.getpid())


def end_with_parent(parent: int | None = None) -> None:
    """End this process soon after its parent has ended, however that ended.

    A thread looks at the parent's number. The system's own signal (``PR_SET_PDEATHSIG``) would come when the *thread*
    ends that started this process, while the parent still lives.

    Args:
        parent: its number, as it told it; a parent that has ended before this process looks is found out by that. Where
            None, what :func:`name_parent` left in the environment, else whoever is the parent now.
    """
    if parent is None:
        parent = int(os.environ.get(_PARENT, os.getppid()))
    threading.Thread(target=_watch, args=(parent,), daemon=True, name="end with parent").start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_EVERY)
    if os.getpgrp() == os.getpid():  # in a session of its own: what it started, a voice that still speaks, ends too
        os.killpg(0, signal.SIGKILL)
    os._exit(1)
