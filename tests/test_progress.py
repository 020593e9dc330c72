"""Progress is a bar where somebody watches, and a few lines where nobody does."""

import io
import sys

import pytest

from dnnvss import progress
from dnnvss.progress import counted


class Clock:
    """A clock that a test moves."""

    def __init__(self) -> None:
        self.now = 0.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(progress, "time", clock)
    return clock


def said(clock: Clock, capsys: pytest.CaptureFixture[str], count: int, seconds: float, **more: int) -> list[str]:
    for _ in counted(range(count), "clips", unit="clips", **more):
        clock.now += seconds
    out, err = capsys.readouterr()
    assert out == "" and "\r" not in err
    return err.splitlines()


def test_a_step_that_is_piped_writes_a_line_a_tenth(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    lines = said(clock, capsys, 1000, 0.1)
    assert lines[0].startswith("clips: 100 of 1000 clips, ")
    assert lines[-1].startswith("clips: 1000 of 1000 clips, 100 s")
    assert len(lines) == 10


def test_a_short_step_writes_nothing(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    assert said(clock, capsys, 50, 0.001) == []


def test_a_slow_step_writes_a_line_every_half_minute(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    lines = said(clock, capsys, 100, 20.0)
    assert 50 <= len(lines) <= 51 and lines[0] == "clips: 2 of 100 clips, 40 s, about 33 min left"
    assert lines[-1].endswith(" s")


def test_a_terminal_has_a_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    monkeypatch.setattr(sys, "stderr", Terminal())
    with counted(total=3, desc="fits") as bar:
        assert not isinstance(bar, progress.Lines)
    with counted(total=3, disable=True) as bar:
        bar.update(1)
    assert isinstance(sys.stderr, Terminal)
