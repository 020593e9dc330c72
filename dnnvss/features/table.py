"""The feature table: an ordered list of blocks from which every width, slice and name derives."""

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from functools import cached_property
from itertools import zip_longest
from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.features.block import Block, Settings
from dnnvss.features.catalogue import catalogue
from dnnvss.features.sources import SOURCES
from dnnvss.settings import read_settings


@dataclass(frozen=True, kw_only=True)
class LabelFile(Settings):
    """A file of ``conf/labels``: the blocks by name, and what the columns of some depend on."""

    name: str | None = None
    blocks: tuple[str, ...]


@dataclass(frozen=True)
class FeatureTable:
    """The columns of the network's input.

    Binary columns are also numbered among themselves (0 to ``binary_width - 1``), in table order: these are the numbers
    that :meth:`FrameCodes.active` returns, with ``binary_width`` for padding. Numeric columns likewise.

    Args:
        names: the blocks, in order.
        settings: what the columns of some blocks depend on.
        title: how messages name the table, such as ``labels=ph``.

    Raises:
        DnnvssError: no block, one that does not exist, or one twice.
    """

    names: tuple[str, ...]
    settings: Settings = field(default_factory=Settings)
    title: str = field(default="the feature table", compare=False)

    def __post_init__(self) -> None:
        known = catalogue(self.settings)
        wrong = [name for name in self.names if name not in known]
        if wrong:
            raise DnnvssError(f"labels: no feature block {wrong[0]!r}", remedy=f"Choose among: {', '.join(known)}")
        if not self.names or len(set(self.names)) != len(self.names):
            raise DnnvssError(f"labels: blocks {list(self.names)} are none or hold one twice",
                              remedy="Name each block once")

    @classmethod
    def from_config(cls, config: Mapping[str, Any]) -> "FeatureTable":
        """The table of a ``conf/labels`` file.

        Its keys are ``blocks`` (a list of names), the fields of :class:`Settings`, and ``name``, by which messages call
        it.

        Raises:
            DnnvssError: an unknown key, a missing list of blocks, or what the table or its settings refuse.
        """
        return cls.from_setting(config, "labels")

    @classmethod
    def from_setting(cls, value: Any, where: str) -> "FeatureTable":
        """The table that a group of settings holds; see :meth:`from_config`."""
        given = read_settings(LabelFile, value, where)
        title = f"labels={given.name}" if given.name else cls.title
        settings = Settings(**{f.name: getattr(given, f.name) for f in fields(Settings)})
        return cls(given.blocks, settings, title)

    @staticmethod
    def alternatives() -> tuple[type, ...]:
        """The types of the settings."""
        return (LabelFile,)

    @cached_property
    def blocks(self) -> tuple[Block, ...]:
        """The blocks in order."""
        return tuple(catalogue(self.settings)[name] for name in self.names)

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """The name of each column, ``block/column``."""
        return tuple(f"{block.name}/{column}" for block in self.blocks for column in block.columns)

    @cached_property
    def slices(self) -> dict[str, slice]:
        """The columns of each block."""
        return _slices(self.blocks)

    @cached_property
    def binary_slices(self) -> dict[str, slice]:
        """The columns of each binary block, counted among binary columns."""
        return _slices(tuple(b for b in self.blocks if b.kind == "binary"))

    @cached_property
    def numeric_slices(self) -> dict[str, slice]:
        """The columns of each numeric block, counted among numeric columns."""
        return _slices(tuple(b for b in self.blocks if b.kind == "numeric"))

    @property
    def width(self) -> int:
        """The number of columns C."""
        return len(self.columns)

    @cached_property
    def binary_width(self) -> int:
        """The number of binary columns; also the padding index."""
        return sum(b.width for b in self.blocks if b.kind == "binary")

    @property
    def numeric_width(self) -> int:
        """The number of numeric columns."""
        return self.width - self.binary_width

    @cached_property
    def active_width(self) -> int:
        """How many binary columns are 1 in a frame at most."""
        return sum(b.slots for b in self.blocks if b.kind == "binary")

    @cached_property
    def binary_columns(self) -> np.ndarray:
        """The table column of each binary column, int64 (binary_width,)."""
        return self._columns_of("binary")

    @cached_property
    def numeric_columns(self) -> np.ndarray:
        """The table column of each numeric column, int64 (numeric_width,)."""
        return self._columns_of("numeric")

    def _columns_of(self, kind: str) -> np.ndarray:
        kinds = np.repeat([b.kind == kind for b in self.blocks], [b.width for b in self.blocks])
        return np.flatnonzero(kinds)

    @cached_property
    def sources(self) -> tuple[str, ...]:
        """The feature sources that some block reads, in the order of :data:`~dnnvss.features.sources.SOURCES`."""
        read = {name for block in self.blocks for name in block.reads}
        return tuple(name for name in SOURCES if name in read)

    @cached_property
    def needs(self) -> frozenset[str]:
        """What a recording must hold: some of ``phones``, ``words``, ``visemes`` and ``sound``."""
        return frozenset[str]().union(*(SOURCES[name].needs for name in self.sources))

    @cached_property
    def hash(self) -> str:
        """A hash of what the columns are; equal hashes mean exchangeable inputs."""
        return hashlib.sha256(" ".join(b.digest for b in self.blocks).encode()).hexdigest()[:16]

    def describe(self) -> dict[str, Any]:
        """Return plain containers that :meth:`from_description` and :meth:`check` understand."""
        return {"settings": asdict(self.settings), "blocks": [b.describe() for b in self.blocks], "hash": self.hash,
                "width": self.width}

    @classmethod
    def from_description(cls, description: Mapping[str, Any]) -> "FeatureTable":
        """Return the table that :meth:`describe` described.

        Raises:
            DnnvssError: this version of the program means something else by one of the blocks.
        """
        settings = read_settings(Settings, description.get("settings", {}), "labels")
        table = cls(tuple(block["name"] for block in _described(description)), settings)
        table.check(description)
        return table

    def check(self, description: Mapping[str, Any]) -> None:
        """Return quietly if the described table has the same columns.

        Raises:
            DnnvssError: it has not; the message names the first block that differs.
        """
        ours, theirs = [b.describe() for b in self.blocks], _described(description)
        for mine, other in zip_longest(ours, theirs):
            if mine is None or other is None:
                where, name = ("here", mine["name"]) if mine else ("in the run", other["name"])
                problem = f"block {name!r} is only {where}"
            elif mine["name"] != other["name"]:
                problem = f"block {mine['name']!r} stands where the run has {other['name']!r}"
            elif mine["width"] != other["width"]:
                problem = f"block {mine['name']!r} has {mine['width']} columns, in the run {other['width']}"
            elif mine["digest"] != other["digest"]:
                problem = f"block {mine['name']!r} means something else in the run"
            else:
                continue
            raise DnnvssError(f"the feature tables differ: {problem}",
                              remedy="Use the labels configuration that the run was trained with, or train again")


def _described(description: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The blocks of a described table.

    Raises:
        DnnvssError: they have no names, widths or digests.
    """
    blocks = description.get("blocks")
    if isinstance(blocks, list | tuple) and all(isinstance(block, Mapping) for block in blocks):
        known = [(block.get("name"), block.get("width"), block.get("digest")) for block in blocks]
        if all([type(part) for part in block] == [str, int, str] for block in known):
            return list(blocks)
    raise DnnvssError("holds no description of a feature table", remedy="Write it again")


def _slices(blocks: tuple[Block, ...]) -> dict[str, slice]:
    ends = np.cumsum([b.width for b in blocks]).tolist()
    return {b.name: slice(end - b.width, end) for b, end in zip(blocks, ends, strict=True)}
