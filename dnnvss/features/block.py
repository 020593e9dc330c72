"""A block of feature columns, and the settings that its size depends on."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from dnnvss.acoustics import HOW, Encoder, Energy, Formants, LogMel, Lpc, Lsf, Mfcc, Voicing
from dnnvss.errors import DnnvssError
from dnnvss.settings import check_settings, setting

LEVELS = ("frame", "segment", "syllable", "word", "phrase", "utterance")
KINDS = ("binary", "numeric")


@dataclass(frozen=True)
class Settings:
    """What the columns of some blocks depend on.

    Args:
        window_before, window_after: frames of the window context on each side (160 ms each at 100 frames a second).
        segment: phones, or dynamic visemes, of a segment, which is as long on both sides of its middle one.
        units: number of dynamic visemes, 0 to ``units - 1``.
        logmel: how the sound is analysed.
        logmel_offsets: the frames around the current one at which it is seen, each once and 0 not among them.
        mfcc, lpc, lsf, formants, energy, voicing: likewise, each an analysis of the sound.
        sound_offsets: the frames around the current one at which these are seen.
        sound_norm: over what the mean and deviation of the columns of a sound are taken out: nothing, all recordings
            of the talker, the recording, or what was heard of it so far, which is causal.
        encoder, encoder_offsets: likewise, how a pretrained encoder hears the sound.

    Raises:
        DnnvssError: a window that is negative, fewer than one unit, an even segment, or an offset twice.
    """

    window_before: int = setting(16, least=0, doc="frames of the window context before the current one")
    window_after: int = setting(16, least=0, doc="frames of the window context after the current one")
    segment: int = setting(5, least=1, most=21, doc="phones, or dynamic visemes, of the segment context; an odd number")
    units: int = setting(160, least=1, doc="number of dynamic visemes")
    logmel: LogMel = setting(LogMel(), doc="bands of the sound")
    logmel_offsets: tuple[int, ...] = setting(tuple(o for o in range(-20, 21, 4) if o), least=-1000, most=1000,
                                              doc="frames around the current one at which the bands are seen")
    mfcc: Mfcc = setting(Mfcc(), doc="mel-frequency cepstral coefficients of the sound")
    lpc: Lpc = setting(Lpc(), doc="coefficients of linear prediction of the sound")
    lsf: Lsf = setting(Lsf(), doc="line spectral frequencies of the sound")
    formants: Formants = setting(Formants(), doc="formants of the sound")
    energy: Energy = setting(Energy(), doc="power of the sound")
    voicing: Voicing = setting(Voicing(), doc="periodicity of the sound")
    sound_offsets: tuple[int, ...] = setting((-1, 1), least=-1000, most=1000,
                                             doc="frames around the current one at which these are seen")
    sound_norm: str = setting("none", choices=HOW, doc="over what columns of a sound are normalised")
    encoder: Encoder = setting(Encoder(), doc="how a pretrained encoder hears the sound")
    encoder_offsets: tuple[int, ...] = setting((-16, -8, 8, 16), least=-1000, most=1000,
                                               doc="frames around the current one at which it is seen")

    def __post_init__(self) -> None:
        check_settings(self, "labels")
        if self.segment % 2 == 0:
            raise DnnvssError(f"labels.segment={self.segment} has no middle one",
                              remedy=f"Give labels.segment={self.segment - 1} or {self.segment + 1}")
        for name, block in (("logmel_offsets", "logmel"), ("sound_offsets", "of the analysis"),
                            ("encoder_offsets", "encoder")):
            offsets = getattr(self, name)
            if 0 in offsets or len(set(offsets)) != len(offsets):
                raise DnnvssError(f"labels.{name}={list(offsets)} names a frame twice, or the current one",
                                  remedy=f"Give each frame once; the block {block} has the current one")

    @property
    def norm(self) -> str:
        """What the keys of sources of sound end in: their normalisation, nothing without one."""
        return "" if self.sound_norm == "none" else f"-{self.sound_norm}"

    @property
    def neighbours(self) -> tuple[int, ...]:
        """The places of a segment relative to its middle one, 0 among them."""
        reach = self.segment // 2
        return tuple(range(-reach, reach + 1))

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
        reads: names of the feature sources whose arrays it looks at.
        kind: ``binary`` (0 or 1, expanded from integer codes) or ``numeric``.
        unit: what the number in a column counts or measures; ``0 or 1`` in a binary block.
        paper: title, table and row, or ``ours``.
        meaning: what the columns hold, for the documentation; part of the digest.
        columns: their names, unique in the block.
        slots: how many of a binary block's columns are 1 at most; a numeric block has as many slots as columns.
        fill: takes a :class:`~dnnvss.features.view.View`, and of binary blocks ``fill(view, start, pad)`` gives the
            columns (B, slots) that are 1, counted from ``start``, and ``pad`` where there is none; of numeric blocks
            ``fill(view, 0, 0)`` gives the values (B, slots).
    """

    name: str
    level: str
    reads: tuple[str, ...]
    kind: str
    unit: str
    paper: str
    meaning: str
    columns: tuple[str, ...]
    slots: int
    fill: Callable[[Any, int, int], Any]

    def __post_init__(self) -> None:
        assert self.level in LEVELS and self.kind in KINDS and self.reads, self.name
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
        """Plain containers."""
        return {"name": self.name, "level": self.level, "reads": list(self.reads), "kind": self.kind,
                "width": self.width, "paper": self.paper, "digest": self.digest}


def binary(name: str, level: str, reads: tuple[str, ...], paper: str, meaning: str, columns: tuple[str, ...],
           slots: int, fill: Callable[[Any, int, int], Any]) -> Block:
    """A block of columns that are 0 or 1."""
    return Block(name, level, reads, "binary", "0 or 1", paper, meaning, columns, slots, fill)


def numeric(name: str, level: str, reads: tuple[str, ...], unit: str, paper: str, meaning: str,
            columns: tuple[str, ...], fill: Callable[[Any, int, int], Any]) -> Block:
    """A block of numbers."""
    return Block(name, level, reads, "numeric", unit, paper, meaning, columns, max(len(columns), 1), fill)


def at_offsets(offsets: tuple[int, ...], names: tuple[str, ...]) -> tuple[str, ...]:
    """The names of columns that repeat at each offset: ``+2:AA``."""
    return tuple(f"{offset:+d}:{name}" for offset in offsets for name in names)


def table_1(row: str) -> str:
    """The paper behind a block of Thangthai 2016."""
    return f"Thangthai 2016, Table 1, {row}"
