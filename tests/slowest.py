"""``pytest --slowest 20``: which tests take most of the processor, whatever else the machine does meanwhile."""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--slowest", type=int, default=0, metavar="N", help="list the N tests that take most seconds of "
                     "the processor, with the programs that they start and the fixtures that are made for them first")


def spent() -> float:
    """Seconds of the processor that this process took, and those that it started and that have ended."""
    times = os.times()
    return time.process_time() + times.children_user + times.children_system


@contextmanager
def timed(item: pytest.Item) -> Iterator[None]:
    before = spent()
    try:
        yield
    finally:
        item.user_properties.append(("processor", spent() - before))  # goes with the report to who asked


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Any:
    with timed(item):
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Any:
    with timed(item):
        return (yield)


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    taken = {report.nodeid: sum(seconds for name, seconds in report.user_properties if name == "processor")
             for reports in terminalreporter.stats.values() for report in reports
             if getattr(report, "when", "") == "teardown"}
    if count := config.getoption("--slowest"):
        terminalreporter.section(f"processor: {sum(taken.values()):.0f} s in {len(taken)} tests")
        for name, seconds in sorted(taken.items(), key=lambda item: -item[1])[:count]:
            terminalreporter.write_line(f"{seconds:7.1f} s  {name}")
