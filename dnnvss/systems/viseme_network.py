"""A network that sees phones and says what gesture may be going on in each frame."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from dnnvss.errors import DnnvssError
from dnnvss.features import CodeStore, FeatureTable, FrameCodes, NumericScaler
from dnnvss.systems.feedforward import FeedForward
from dnnvss.systems.frame_network import filled
from dnnvss.systems.unheard import heard_phones, lend_weights
from dnnvss.timing import FrameClock, Tier
from dnnvss.training.batches import FrameBatches
from dnnvss.training.classification import FrameClassification
from dnnvss.training.recipe import one_cycle
from dnnvss.training.settings import FitSettings
from dnnvss.visemes import Evidence

_CHUNK = 4096  # frames a forward pass at prediction
HEEDED = ("learning_rate", "weight_decay", "warmup", "batch_size", "epochs", "share", "clip", "seed")
"""The settings of a fit that :meth:`UnitNetwork.fit` heeds; its optimiser is AdamW."""


@dataclass(frozen=True)
class UnitNetwork:
    """Posteriors of units and of cuts in each frame. Build with :meth:`fit`.

    Args:
        table: the columns that it reads, none of them of dynamic visemes.
        units: number of units U.
        hidden: width of the layers.
        network: columns to U + 1 logits.
        scaler: of the numeric columns.
    """

    table: FeatureTable
    units: int
    hidden: tuple[int, ...]
    network: FeedForward
    scaler: NumericScaler

    @classmethod
    def fit(cls, train: Sequence[tuple[FrameCodes, np.ndarray]], val: Sequence[tuple[FrameCodes, np.ndarray]],
            units: int, hidden: Sequence[int], dropout: float, settings: FitSettings, folder: Path) -> "UnitNetwork":
        """The network of the epoch with the least loss on the validation utterances.

        A fit that was killed goes on from its last epoch and ends with the same weights.

        Args:
            train: frame codes, and the unit and cut (T, 2) of each frame, by utterance.
            val: the same for choosing the epoch.
            units: U.
            hidden: width of each layer.
            dropout: share of active columns left out in training.
            settings: those named in :data:`HEEDED`.
            folder: of checkpoints.

        Raises:
            DnnvssError: the loss is not finite.
        """
        from dnnvss.training.fit import alone, run_fit

        table = train[0][0].table
        torch.manual_seed(settings.seed)
        scaler = NumericScaler.fit(_store(train))
        network = FeedForward(table.binary_width, table.numeric_width, table.active_width, units + 1, hidden,
                              input_dropout=dropout)
        made = cls(table, units, tuple(hidden), network, scaler)
        ours = replace(alone(settings), patience=settings.epochs)
        run_fit(network, FrameClassification(_diverged), one_cycle(ours), made._batches(train, ours, ours.seed),
                made._batches(val, ours, None), ours, folder)
        lend_weights(network.first, table, heard_phones(codes for codes, _ in train))
        network.eval()
        return made

    @torch.inference_mode()
    def evidence(self, codes: FrameCodes) -> Evidence:
        """Return what the frames of an utterance suggest; its codes may be those of any table."""
        codes = codes.with_table(self.table)
        out = []
        for start in range(0, len(codes), _CHUNK):
            frames = np.arange(start, min(start + _CHUNK, len(codes)))
            numeric = torch.from_numpy(self.scaler(codes.numeric(frames)))
            out.append(self.network(torch.from_numpy(codes.active(frames)), numeric).double())
        logits = torch.cat(out)
        return Evidence(logits[:, :-1].log_softmax(1).numpy(), logits[:, -1].numpy())

    def state(self) -> dict[str, Any]:
        """Return tensors and plain containers."""
        return {"table": self.table.describe(), "units": self.units, "hidden": list(self.hidden),
                "scaler": self.scaler.describe(), "weights": self.network.state_dict()}

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> "UnitNetwork":
        """Return the network that :meth:`state` described."""
        table = FeatureTable.from_description(state["table"])
        network = filled(lambda: FeedForward(table.binary_width, table.numeric_width, table.active_width,
                                             state["units"] + 1, state["hidden"]), state["weights"])
        return cls(table, state["units"], tuple(state["hidden"]), network.eval(),
                   NumericScaler.from_description(state["scaler"]))

    def _batches(self, pairs: Sequence[tuple[FrameCodes, np.ndarray]], settings: FitSettings,
                 seed: int | None) -> FrameBatches:
        targets = np.concatenate([t for _, t in pairs]).astype(np.float32)
        drawn = (settings.batch_size, settings.share, seed) if seed is not None else (_CHUNK, 1.0, None)
        return FrameBatches(_store(pairs), self.scaler, targets, np.arange(len(targets)), *drawn)


def _diverged(where: str, value: float) -> DnnvssError:
    return DnnvssError(f"the viseme network diverged: {where} is {value:.4g}",
                       remedy="Lower visemes.predictor.fit.learning_rate")


def _store(pairs: Sequence[tuple[FrameCodes, np.ndarray]]) -> CodeStore:
    return CodeStore.join((str(i), codes) for i, (codes, _) in enumerate(pairs))


def unit_targets(tier: Tier, clock: FrameClock) -> np.ndarray:
    """Return the unit of each frame and whether a gesture begins with it, (T, 2), of a tier ``visemes``."""
    index = tier.frame_index(clock)
    cuts = np.diff(index, prepend=index[0]) > 0
    return np.stack([np.array([int(label) for label in tier.labels])[index], cuts], axis=1)


def unit_sequence(tier: Tier, clock: FrameClock) -> tuple[np.ndarray, np.ndarray]:
    """Return the units (G,) of a tier ``visemes`` and their frames (G,), without units that own no frame."""
    frames = np.diff(tier.frame_edges(clock))
    units = np.array([int(label) for label in tier.labels])
    return units[frames > 0], frames[frames > 0]
