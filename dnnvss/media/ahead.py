"""Pictures that a thread of its own makes while those before them are encoded."""

from collections import deque
from collections.abc import Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, TypeVar

T = TypeVar("T")
_END: Any = object()


def ahead(items: Iterable[T], most: int = 8) -> Generator[T]:
    """Yield the items in their order, each made by a thread up to ``most`` items before it is asked for.

    What drawing and encoding call lets other threads run, so that both go on at once where there are two cores. An
    error of the one who makes them is raised where its item would have come.

    Args:
        items: made one after the other, never two at once.
        most: how many may wait in memory.
    """
    source = iter(items)
    with ThreadPoolExecutor(1, "ahead") as maker:
        waiting: deque[Future[T]] = deque(maker.submit(next, source, _END) for _ in range(most))
        try:
            while (item := waiting.popleft().result()) is not _END:
                waiting.append(maker.submit(next, source, _END))
                yield item
        finally:
            maker.shutdown(wait=True, cancel_futures=True)
