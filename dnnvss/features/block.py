"""A block of feature columns, and the settings that its size depends on."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from dnnvss.errors import DnnvssError

if TYPE_CHECKING:
    from dnnvss.features.codes import View

LEVELS = ("frame", "segment", "syllable", "word", "phrase", "utterance")
FAMILIES = ("ph", "dv", "both")


@dataclass(frozen=True)
class Settings:
    """What the width of some blocks depends on.

    Args:
        window_before, window_after: frames of the window context on each side (160 ms each at 100 frames a second).
        units: number of dynamic visemes, 0 to ``units - 1``.

    Raises:
        DnnvssError: a window that is negative, or fewer than one unit.
    """

    window_before: int = 16
    window_after: int = 16
    units: int = 160

    def __post_init__(self) -> None:
        for name in ("window_before", "window_after", "units"):
            value, least = getattr(self, name), 1 if name == "units" else 0
            if not isinstance(value, int) or isinstance(value, bool) or value < least:
                raise DnnvssError(f"labels: {name} is {value!r}", remedy=f"Give a whole number of at least {least}")

    @property
    def offsets(self) -> tuple[int, ...]:
        """The frames of the window relative to the current one, which is not among them."""
        return (*range(-self.window_before, 0), *range(1, self.window_after + 1))


@dataclass(frozen=True)
class Block:
    """A named group of columns of the feature table.

    Args:
        name: how YAML selects it.
        level: where its information comes from, one of :data:`LEVELS`.
        family: the unit that it describes: ``ph``, ``dv`` or ``both``.
        kind: ``binary`` (0 or 1, expanded from integer codes) or ``numeric``.
        source: paper, table and row, or ``ours``.
        meaning: what the columns hold, for the documentation; part of the digest.
        columns: their names, unique in the block.
        slots: how many of a binary block's columns are 1 at most; a numeric block has as many slots as columns.
        fill: of binary blocks ``fill(view, start, pad)`` gives the columns (B, slots) that are 1, counted from
            ``start``, and ``pad`` where there is none; of numeric blocks ``fill(view, 0, 0)`` the values (B, slots).
    """

    name: str
    level: str
    family: str
    kind: str
    source: str
    meaning: str
    columns: tuple[str, ...]
    slots: int
    fill: Callable[["View", int, int], Any]

    def __post_init__(self) -> None:
        assert self.level in LEVELS and self.family in FAMILIES and self.kind in ("binary", "numeric"), self.name
        assert len(set(self.columns)) == len(self.columns) and self.slots > 0, self.name

    @property
    def width(self) -> int:
        """The number of columns."""
        return len(self.columns)

    @property
    def digest(self) -> str:
        """A hash of what the columns are and mean; networks with different digests cannot share weights."""
        parts = "\n".join((self.name, self.level, self.kind, self.meaning, *self.columns))
        return hashlib.sha256(parts.encode()).hexdigest()[:12]

    def describe(self) -> dict[str, Any]:
        """Return plain containers."""
        return {"name": self.name, "level": self.level, "family": self.family, "kind": self.kind, "width": self.width,
                "source": self.source, "digest": self.digest}
