"""The latest of many things, by name: so many are kept, and so much of them."""

from collections import OrderedDict
from threading import Lock
from typing import Generic, TypeVar

T = TypeVar("T")


class Latest(Generic[T]):
    """Things by name; those that were asked for the longest ago make room for others.

    Args:
        most: things that are kept.
        size_most: that they may have together; the last one is kept in any case.
    """

    def __init__(self, most: int, size_most: float) -> None:
        self._most, self._size_most, self._size = most, size_most, 0
        self._things, self._lock = OrderedDict[str, tuple[T, int]](), Lock()

    def __len__(self) -> int:
        return len(self._things)

    def put(self, name: str, thing: T, size: int) -> list[str]:
        """Keep a thing, in the place of one of that name; the names of those that had to go for it."""
        gone = list[str]()
        with self._lock:
            _, before = self._things.pop(name, (None, 0))
            self._things[name] = thing, size
            self._size += size - before
            while len(self._things) > self._most or (self._size > self._size_most and len(self._things) > 1):
                old, (_, own) = self._things.popitem(last=False)
                self._size -= own
                gone.append(old)
        return gone

    def get(self, name: str) -> T | None:
        """The thing of a name, None where it is not kept."""
        with self._lock:
            if name not in self._things:
                return None
            self._things.move_to_end(name)
            return self._things[name][0]

    def items(self) -> list[tuple[str, T]]:
        """All by name, the one asked for longest ago first."""
        with self._lock:
            return [(name, thing) for name, (thing, _) in self._things.items()]
