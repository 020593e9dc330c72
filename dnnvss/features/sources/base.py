"""What a feature source declares: its arrays, its blocks of columns, and how a recording becomes its arrays."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from dnnvss.features.block import Block, Settings
from dnnvss.features.fields import Field
from dnnvss.features.recording import Recording
from dnnvss.timing import FrameClock


class Codes(Protocol):
    """What holds the arrays of frame codes."""

    @property
    def arrays(self) -> Mapping[str, Any]:
        """By name."""


def _fits(settings: Settings, arrays: Mapping[str, Any]) -> None:
    del settings, arrays


def _same(settings: Settings) -> str:
    del settings
    return ""


@dataclass(frozen=True)
class FeatureSource:
    """A kind of input: phones, dynamic visemes, the sound.

    Args:
        name: how blocks say that they read it.
        needs: what a recording must hold: some of ``phones``, ``words``, ``visemes`` and ``sound``.
        fields: of the settings, its arrays by name. No other source has one of these names, and nothing outside the
            source uses them.
        blocks: of the settings, its blocks in the order of the documentation.
        encode: ``encode(recording, settings, clock, frames)`` gives the arrays of one utterance of so many frames; axes
            of its own are numbered from 0.
        absent: what to say where a block is asked for and the arrays are not there: what is needed, and the remedy.
        always: whether a recording that can be encoded is, though no block asks for it: some systems look up by it.
        check: ``check(settings, arrays)`` refuses arrays that the blocks of these settings cannot serve.
        facts: ``facts(settings, clock)`` is a sentence on the settings, for the documentation.
        key: of the settings, what the numbers in the arrays depend on; arrays with another key are refused.
    """

    name: str
    needs: frozenset[str]
    fields: Callable[[Settings], Mapping[str, Field]]
    blocks: Callable[[Settings], list[Block]]
    encode: Callable[[Recording, Settings, FrameClock, int], dict[str, Any]]
    absent: tuple[str, str]
    facts: Callable[[Settings, FrameClock], str]
    always: bool = False
    check: Callable[[Settings, Mapping[str, Any]], None] = _fits
    key: Callable[[Settings], str] = _same

    def encodes(self, recording: Recording) -> bool:
        """Whether the recording holds what is needed."""
        tiers = [] if recording.alignment is None else [tier.name for tier in recording.alignment.tiers]
        sound = [] if recording.sound is None else ["sound"]
        return self.needs <= {*tiers, *sound}
