"""How far a long step is: a bar where somebody watches, a line now and then where a file or a pipe does."""

import sys
import time
from collections.abc import Iterable
from typing import Any

from tqdm import tqdm

TENTHS = 10
"""Lines of a whole step at most, where none of its tenths takes long."""
LONGEST = 30.0
"""Seconds without a line, about."""
LEFT = 60.0
"""Seconds from which it is told how long the rest will take."""
SHORTEST = 1.0
"""Seconds between two lines at least."""


def counted(iterable: Iterable[Any] | None = None, desc: str = "", *,
            total: int | None = None, initial: int = 0, unit: str = "", disable: bool = False) -> "tqdm[Any]":
    """A bar of tqdm's on a terminal; elsewhere the same in lines, one at every tenth of the way or half minute.

    Args:
        iterable: what is gone through; None where ``update`` is called.
        desc: what is done.
        total: steps in all; those of the iterable where None.
        initial: steps that were done before.
        unit: of a step.
        disable: show nothing.
    """
    watched = sys.stderr is not None and sys.stderr.isatty()
    kind: Any = tqdm if watched else Lines
    return kind(iterable, desc, total=total, initial=initial, unit=f" {unit}" if unit else "", leave=False,
                disable=disable)


class Lines(tqdm):  # type: ignore[type-arg]
    """A bar that writes lines: ``encoding clips: 40 of 400 clips, 12 s, about 2 min left``."""

    disable: bool

    def __init__(self, *given: Any, **more: Any) -> None:
        self.told, self.begun = 0, time.monotonic()
        self.at = self.begun
        super().__init__(*given, **more, mininterval=0.0, miniters=1)

    def display(self, msg: str | None = None, pos: int | None = None) -> bool:
        """Write a line, if it is time."""
        del msg, pos
        tenth, away = int(TENTHS * self.n / self.total) if self.total else 0, time.monotonic() - self.at
        if (tenth > self.told and away >= SHORTEST) or away >= LONGEST:
            self._tell(tenth)
        return True

    def clear(self, nolock: bool = False) -> None:
        """Nothing: lines stay."""

    def close(self) -> None:
        """End; a step that was told about and is over gets a last line."""
        if self.disable:
            return
        self.disable = True
        self._decr_instances(self)
        if 0 < self.told < TENTHS and self.n == self.total:
            self._tell(TENTHS)

    def _tell(self, tenth: int) -> None:
        self.told, self.at = tenth, time.monotonic()
        of = f" of {self.total}" if self.total else ""
        print(f"{self.desc.removesuffix(': ')}: {self.n}{of}{self.unit}, {self.at - self.begun:.0f} s{self._left()}",
              file=sys.stderr, flush=True)

    def _left(self) -> str:
        """About how long the rest will take, where that is a minute and more."""
        done = self.n - self.initial
        rest = (self.at - self.begun) / done * (self.total - self.n) if self.total and done > 0 else 0.0
        return f", about {rest / 60:.0f} min left" if rest >= LEFT else ""
