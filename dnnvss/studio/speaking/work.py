"""Work that keeps a processor busy: so much at a time, so much that waits, and a clear answer beyond that."""

import threading
import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import contextmanager

from dnnvss.studio.page import BusyError


class Work:
    """A bound on what is done at once and on what waits for it.

    Args:
        at_once: tasks that are worked on.
        waiting: tasks that wait for one of these to end.
        patience: seconds that a task waits.
    """

    def __init__(self, at_once: int = 2, waiting: int = 64, patience: float = 30.0) -> None:
        self._free, self._lock = threading.Semaphore(at_once), threading.Lock()
        self._most, self._patience = at_once + waiting, patience
        self.inside, self.done = 0, Counter[str]()
        self.seconds: defaultdict[str, float] = defaultdict(float)

    @contextmanager
    def task(self, name: str) -> Iterator[None]:
        """Do something that keeps a processor busy in the block.

        Raises:
            BusyError: too much is waiting, or it waited too long.
        """
        with self._lock:
            if self.inside >= self._most:
                self.done["refused"] += 1
                raise BusyError("too many are waiting", remedy="Ask again in a moment")
            self.inside += 1
        try:
            if not self._free.acquire(timeout=self._patience):
                with self._lock:
                    self.done["refused"] += 1
                raise BusyError("waited too long", remedy="Ask again in a moment")
            begun = time.monotonic()
            try:
                yield
            finally:
                self._free.release()
                with self._lock:
                    self.done[name] += 1
                    self.seconds[name] += time.monotonic() - begun
        finally:
            with self._lock:
                self.inside -= 1

    def told(self) -> str:
        """Counts and seconds in the text form of Prometheus."""
        with self._lock:
            lines = [f"dnnvss_work_inside {self.inside}"]
            lines += [f'dnnvss_work_total{{task="{name}"}} {count}' for name, count in sorted(self.done.items())]
            lines += [f'dnnvss_work_seconds_total{{task="{name}"}} {seconds:.3f}'
                      for name, seconds in sorted(self.seconds.items())]
        return "\n".join([*lines, ""])
