"""Items made ahead: in order, no more than asked for at once, errors where they belong."""

import threading
from collections.abc import Iterator
from contextlib import closing

import pytest

from dnnvss.media.ahead import ahead


def test_items_come_in_order_from_one_other_thread() -> None:
    makers: set[str] = set()

    def made() -> Iterator[int]:
        for k in range(30):
            makers.add(threading.current_thread().name)
            yield k

    assert list(ahead(made())) == list(range(30)) and list(ahead([])) == []
    assert len(makers) == 1 and threading.current_thread().name not in makers


def test_no_more_are_made_than_may_wait() -> None:
    made: list[int] = []
    with closing(ahead((made.append(k) or k for k in range(100)), most=4)) as items:
        assert next(items) == 0 and next(items) == 1
    assert 2 <= len(made) <= 6  # those that were taken, and those that waited
    assert threading.active_count() == 1 or not [t for t in threading.enumerate() if t.name.startswith("ahead")]


def test_an_error_comes_where_its_item_would_have() -> None:
    def made() -> Iterator[int]:
        yield from range(3)
        raise ValueError("no more")

    found = []
    with pytest.raises(ValueError, match="no more"):
        for item in ahead(made()):
            found.append(item)
    assert found == [0, 1, 2]
