"""Random batches of frames, drawn from the codes of all utterances at once."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Self

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import IterableDataset

from dnnvss.labels import CodeStore, NumericScaler

Batch = tuple[Tensor, Tensor, Tensor]
"""Active columns (B, A) int32, normalised numeric inputs (B, N) and normalised targets (B, W x D)."""


class FrameBatches(IterableDataset):
    """Batches of frames in an order that depends only on the seed and the epoch, so that a resumed run sees the same.

    Args:
        store: frame codes of all utterances, S frames.
        scaler: of the numeric inputs.
        targets: normalised streams (S, W x D) float32.
        frames: which frames may be drawn.
        batch_size: frames a batch; a last batch that is not full is left out where frames are drawn at random.
        share: part of the frames drawn in an epoch.
        seed: of the order; None keeps the order of ``frames`` and every frame.
        epoch: returns the number of the epoch.
        alternatives: stores of other codes for the same frames; batches take their inputs from all stores in turn.
        place: returns the number of this process and of all that share the fit. Each takes its part of every batch, so
            that all of them together draw what one would.
    """

    def __init__(self, store: CodeStore, scaler: NumericScaler, targets: np.ndarray, frames: np.ndarray,
                 batch_size: int, share: float = 1.0, seed: int | None = None,
                 epoch: Callable[[], int] = lambda: 0, alternatives: Sequence[CodeStore] = (),
                 place: Callable[[], tuple[int, int]] = lambda: (0, 1)) -> None:
        self.stores, self.scaler = (store, *alternatives), scaler
        self.targets, self.frames = torch.from_numpy(targets), frames
        self.batch_size, self.share, self.seed, self.epoch = min(batch_size, len(frames)), share, seed, epoch
        self.place = place

    def __len__(self) -> int:
        if self.seed is None:
            return -(-len(self.frames) // self.batch_size)
        return max(1, int(len(self.frames) * self.share) // self.batch_size)

    def __iter__(self) -> Iterator[Batch]:
        order: Any = self.frames
        if self.seed is not None:
            order = np.random.default_rng([self.seed, self.epoch()]).permutation(self.frames)
        if self.targets.device.type != "cpu":
            order = torch.from_numpy(order).to(self.targets.device)
        rank, world = self.place()
        for number in range(len(self)):
            frames = order[number * self.batch_size : (number + 1) * self.batch_size]
            own = frames[rank::world]
            yield self.batch(own if len(own) else frames[:1], number)  # too few to share: one twice

    def to(self, device: Any) -> Self:
        """Move codes and targets to a device, which then draws batches without the host (11 bytes of codes a frame)."""
        self.stores = tuple(store.to(device) for store in self.stores)
        self.targets = self.targets.to(device)
        return self

    def batch(self, frames: Any, number: int = 0) -> Batch:
        """Return the inputs and targets of the given frames, inputs from the store whose turn it is."""
        store = self.stores[number % len(self.stores)]
        active, numeric = store.active(frames), self.scaler(store.numeric(frames))
        return torch.as_tensor(active), torch.as_tensor(numeric), self.targets[torch.as_tensor(frames)]
