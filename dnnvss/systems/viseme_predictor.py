"""Dynamic visemes from phones: a network says what gesture may be going on, and a decoder which one is."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from dnnvss.corpus import Utterance
from dnnvss.features import FrameCodes, encode
from dnnvss.settings import read_settings
from dnnvss.systems.viseme_network import UnitNetwork
from dnnvss.timing import Alignment, FrameClock, Tier
from dnnvss.training.checkpoints import read_checkpoint, save_checkpoint
from dnnvss.visemes import DecodingSettings, Grammar, Visemes, sample, viseme_tier, viterbi

_MOST = 1000
"""Tiers that are drawn for an utterance, beyond which a file is damaged."""


@dataclass(frozen=True)
class VisemePredictor:
    """Dynamic visemes from phones and context alone.

    Args:
        network: what each frame suggests.
        grammar: bigram and durations.
        decoding: what counts how much.
        clock: of the frames.
    """

    network: UnitNetwork
    grammar: Grammar
    decoding: DecodingSettings
    clock: FrameClock

    def tier(self, codes: FrameCodes, alignment: Alignment) -> Tier:
        """Return the most likely tier ``visemes`` of an utterance; ``codes`` are its frame codes, of any table."""
        return self._tier(*viterbi(self.network.evidence(codes), self.grammar, self.decoding), alignment)

    def samples(self, codes: FrameCodes, alignment: Alignment, count: int, seed: int = 0) -> list[Tier]:
        """Return tiers drawn with the probability that the model gives them."""
        drawn = sample(self.network.evidence(codes), self.grammar, self.decoding, count, seed)
        return [self._tier(edges, units, alignment) for edges, units in drawn]

    def _tier(self, edges: np.ndarray, units: np.ndarray, alignment: Alignment) -> Tier:
        return viseme_tier(edges, units, self.clock, (alignment.start, alignment.end))


@dataclass(frozen=True)
class UnitModel:
    """The units of a talker and their predictor.

    Args:
        visemes: the units.
        predictor: text to units.
        samples: see :class:`dnnvss.systems.viseme_plan.UnitPlan`.
    """

    visemes: Visemes
    predictor: VisemePredictor
    samples: int

    def tiers(self, utterance: Utterance, codes: FrameCodes | None = None) -> list[Tier]:
        """Return the predicted tiers of an utterance: the most likely one, and as many more as ``samples`` says."""
        alignment = utterance.alignment
        if codes is None:
            codes = encode(alignment, utterance.text, self.predictor.network.table, self.predictor.clock)
        drawn = self.predictor.samples(codes, alignment, self.samples) if self.samples else []
        return [self.predictor.tier(codes, alignment), *drawn]

    def save(self, path: Path) -> None:
        """Write tensors and plain containers."""
        p = self.predictor
        save_checkpoint(path, _tensors({
            "visemes": self.visemes.describe(), "network": p.network.state(), "grammar": p.grammar.describe(),
            "decoding": asdict(p.decoding), "clock": str(p.clock), "samples": self.samples}))

    @classmethod
    def load(cls, path: Path) -> "UnitModel":
        """Return what :meth:`save` wrote.

        Raises:
            DnnvssError: the file is missing or damaged.
        """
        return read_checkpoint(path, cls._built, "Train the run anew: dnnvss train overwrite=true")

    @classmethod
    def _built(cls, s: dict[str, Any]) -> "UnitModel":
        predictor = VisemePredictor(UnitNetwork.from_state(s["network"]), Grammar.from_description(s["grammar"]),
                                    read_settings(DecodingSettings, s["decoding"], "decoding"), FrameClock(s["clock"]))
        if type(s["samples"]) is not int or not 0 <= s["samples"] <= _MOST:
            raise ValueError(f"samples is {s['samples']!r}")
        model = cls(Visemes.from_description(s["visemes"]), predictor, s["samples"])
        if len(model.visemes) != len(predictor.grammar):
            raise ValueError(f"{len(model.visemes)} units and a grammar of {len(predictor.grammar)}")
        return model


def _tensors(value: Any) -> Any:
    """Return nested containers with their arrays as tensors."""
    if isinstance(value, dict):
        return {key: _tensors(v) for key, v in value.items()}
    return torch.from_numpy(value) if isinstance(value, np.ndarray) else value
