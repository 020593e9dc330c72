"""Batches of whole utterances, for networks over time and for losses that look at a trajectory."""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from torch import Tensor

from dnnvss.features import NumericScaler
from dnnvss.training.batches import Codes, FrameBatches

Utterances = tuple[Tensor, Tensor, Tensor, Tensor, Tensor]
"""Active columns (N, A) int32, normalised numbers (N, M), targets (N, W x D), which frames were
measured (N,) bool, of utterances one after the other, and how many frames each has (B,)."""
LONGEST = 3000
"""Frames of an utterance in training; a longer one is cut into equal parts, which bounds memory."""


class UtteranceBatches(FrameBatches):
    """Whole utterances in an order that depends only on the seed and the epoch.

    Args:
        store, scaler, targets, share, seed, epoch, alternatives, normal, place: see
            :class:`FrameBatches`. Of each batch every process takes its part of the utterances.
        valid: frames that were measured (S,) bool.
        size: utterances a batch; the last one may be smaller.
    """

    def __init__(self, store: Codes, scaler: NumericScaler, targets: np.ndarray, valid: np.ndarray, size: int,
                 share: float = 1.0, seed: int | None = None, epoch: Callable[[], int] = lambda: 0,
                 alternatives: Sequence[Codes] = (), normal: tuple[np.ndarray, np.ndarray] | None = None,
                 place: Callable[[], tuple[int, int]] = lambda: (0, 1)) -> None:
        super().__init__(store, scaler, targets, np.arange(len(valid)), size, share, seed, 1, epoch, alternatives,
                         normal, place)
        starts = np.asarray(store.arrays["utterance_start"], np.int64)
        self.parts = parts_of(starts, np.asarray(store.arrays["utterance_frames"], np.int64))
        self.valid, self.size = torch.from_numpy(np.array(valid, dtype=bool)), size

    def __len__(self) -> int:
        return -(-self._drawn // self.size)

    @property
    def at_once(self) -> int:
        """Batches that are drawn at once."""
        return 1

    @property
    def _drawn(self) -> int:
        """Utterances of an epoch."""
        share = 1.0 if self.seed is None else self.share
        return max(1, int(len(self.parts) * share))

    def blocks(self, at_once: int) -> Iterator[list[Utterances]]:  # type: ignore[override]
        """The batches of an epoch in order, ``at_once`` at a time."""
        order = np.arange(len(self.parts))
        if self.seed is not None:
            order = np.random.default_rng([self.seed, self.epoch()]).permutation(len(order))[: self._drawn]
        batches = [order[i : i + self.size] for i in range(0, len(order), self.size)]
        for first in range(0, len(batches), at_once):
            turn = self.epoch() * len(batches) + first  # as of frames: stores go on from epoch to epoch
            yield [self.whole(batch, turn + k) for k, batch in enumerate(batches[first : first + at_once])]

    def whole(self, batch: np.ndarray, turn: int) -> Utterances:
        """This process's part of the utterances of a batch; ``turn`` tells whose codes are drawn."""
        rank, world = self.place()
        own = batch[rank::world] if len(batch) > rank else batch[:1]
        frames = [np.arange(*self.parts[i]) for i in own]
        joined: Any = np.concatenate(frames)
        if self.targets.device.type != "cpu":
            joined = torch.from_numpy(joined).to(self.targets.device)
        active, numeric, targets = self.draw([joined], turn)[0]
        valid = self.valid.to(self.targets.device)[torch.as_tensor(joined)]
        return active, numeric, targets, valid, torch.tensor([len(part) for part in frames])


def parts_of(starts: np.ndarray, frames: np.ndarray) -> list[tuple[int, int]]:
    """First frame and the one after the last of every utterance, or of the parts of a long one."""
    found = []
    for start, count in zip(starts.tolist(), frames.tolist(), strict=True):
        edges = np.linspace(start, start + count, -(-count // LONGEST) + 1).round().astype(int).tolist()
        found += list(pairwise(edges))
    return found
