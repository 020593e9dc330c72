"""Batches of whole utterances, for losses that look at a trajectory."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import IterableDataset

Utterances = tuple[Tensor, Tensor, Tensor, Tensor, Tensor]
"""Active columns (N, A) int32, normalised numbers (N, M), measured trajectories (N, D), which frames were measured
(N,) bool, of utterances one after the other, and how many frames each of them has (B,)."""


@dataclass(frozen=True)
class Measurement:
    """One utterance: active columns (T, A), numbers (T, M), measured trajectory (T, D), measured frames (T,)."""

    active: Tensor
    numeric: Tensor
    static: Tensor
    valid: Tensor


class UtteranceBatches(IterableDataset):
    """Whole utterances in an order that depends only on the seed and the epoch.

    Args:
        utterances: of which the batches are made.
        size: utterances a batch; the last one may be smaller.
        seed: of the order; None keeps the order given.
        epoch: returns the number of the epoch.
    """

    at_once = 1

    def __init__(self, utterances: Sequence[Measurement], size: int, seed: int | None = None,
                 epoch: Callable[[], int] = lambda: 0) -> None:
        self.utterances, self.size, self.seed, self.epoch = utterances, size, seed, epoch

    def __len__(self) -> int:
        return -(-len(self.utterances) // self.size)

    def __iter__(self) -> Iterator[Utterances]:
        for block in self.blocks(self.at_once):
            yield from block

    def blocks(self, at_once: int) -> Iterator[list[Utterances]]:
        """The batches of an epoch in order, ``at_once`` at a time."""
        order = np.arange(len(self.utterances))
        if self.seed is not None:
            order = np.random.default_rng([self.seed, self.epoch()]).permutation(len(order))
        batches = [order[i : i + self.size] for i in range(0, len(order), self.size)]
        for first in range(0, len(batches), at_once):
            yield [self._joined(batch) for batch in batches[first : first + at_once]]

    def _joined(self, batch: np.ndarray) -> Utterances:
        own = [self.utterances[i] for i in batch]
        active, numeric, static, valid = (torch.cat([getattr(u, name) for u in own])
                                          for name in ("active", "numeric", "static", "valid"))
        return active, numeric, static, valid, torch.tensor([len(u.static) for u in own])
