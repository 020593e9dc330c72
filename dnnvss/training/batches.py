"""Random batches of frames, drawn from the codes of all utterances at once."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol, Self

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import IterableDataset

from dnnvss.features import NumericScaler

Batch = tuple[Tensor, Tensor, Tensor]
"""Active columns (B, A) int32, normalised numeric inputs (B, N) and normalised targets (B, W x D)."""


class Codes(Protocol):
    """What inputs are drawn from, such as a :class:`~dnnvss.features.CodeStore`."""

    @property
    def arrays(self) -> dict[str, Any]:
        """Arrays by name: where utterances start, and how many frames they have."""
        ...

    def active(self, frames: Any) -> Any:
        """Active columns (B, A) of frames."""
        ...

    def numeric(self, frames: Any) -> Any:
        """Numbers (B, N) of frames, not normalised."""
        ...

    def to(self, device: Any) -> Self:
        """The same as tensors on a device."""
        ...


AT_ONCE = {"cpu": 4096, "cuda": 65536}
"""About how many frames are drawn at once: enough that the calls themselves cost little beside what they do."""


class FrameBatches(IterableDataset):
    """Batches of frames in an order that depends only on the seed and the epoch, so that a resumed run sees the same.

    Args:
        store: frame codes of all utterances, S frames.
        scaler: of the numeric inputs.
        targets: streams (S, W x D) float32.
        frames: which frames may be drawn.
        batch_size: frames a batch; a last batch that is not full is left out where frames are drawn at random.
        share: part of the frames drawn in an epoch.
        seed: of the order; None keeps the order of ``frames`` and every frame.
        members: networks that are trained together. Each has an order of its own, of seeds that go on counting; in a
            batch their frames lie one network behind the other.
        epoch: returns the number of the epoch.
        alternatives: stores of other codes for the same frames; batches take their inputs from all stores in turn.
        normal: mean and deviation (W x D,) by which targets are normalised as they are drawn; not at all if left out.
        least: batches that an epoch has at least; where the frames do not suffice they are drawn again.
        place: returns the number of this process and of all that share the fit. Each takes its part of every batch, so
            that all of them together draw what one would.
    """

    def __init__(self, store: Codes, scaler: NumericScaler, targets: np.ndarray, frames: np.ndarray,
                 batch_size: int, share: float = 1.0, seed: int | None = None, members: int = 1,
                 epoch: Callable[[], int] = lambda: 0, alternatives: Sequence[Codes] = (),
                 normal: tuple[np.ndarray, np.ndarray] | None = None,
                 place: Callable[[], tuple[int, int]] = lambda: (0, 1), least: int = 1) -> None:
        self.stores: tuple[Codes, ...] = (store, *alternatives)
        self.scaler = scaler
        self.targets, self.frames = torch.from_numpy(targets), frames
        self.batch_size, self.share, self.seed, self.epoch = min(batch_size, len(frames)), share, seed, epoch
        self.members, self.place, self.least = members, place, max(1, least)
        self.normal = None if normal is None else tuple(torch.from_numpy(np.float32(part)) for part in normal)

    def __len__(self) -> int:
        if self.seed is None:
            return -(-len(self.frames) // self.batch_size)
        return max(self.least, int(len(self.frames) * self.share) // self.batch_size)

    def __iter__(self) -> Iterator[Batch]:
        for block in self.blocks(self.at_once):
            yield from block

    @property
    def at_once(self) -> int:
        """Batches that are drawn at once."""
        return max(1, AT_ONCE[self.targets.device.type] // (self.batch_size * self.members))

    def blocks(self, at_once: int) -> Iterator[list[Batch]]:
        """Return the batches of an epoch in order, drawn ``at_once`` at a time."""
        orders = [self._order(k) for k in range(self.members)]
        rank, world = self.place()
        for first in range(0, len(self), at_once):
            numbers = range(first, min(first + at_once, len(self)))
            batches = [[order[k * self.batch_size : (k + 1) * self.batch_size] for order in orders] for k in numbers]
            own = [[frames[rank::world] if len(frames) > rank else frames[:1] for frames in batch] for batch in batches]
            turn = self.epoch() * len(self) + first  # the stores' turns go on from epoch to epoch
            yield self.draw([_joined(batch) for batch in own], turn)  # too few frames to share: one of them twice

    def _order(self, member: int) -> Any:
        order: Any = self.frames
        if self.seed is not None:
            chance = np.random.default_rng([self.seed + member, self.epoch()])
            passes = max(1, -(-len(self) * self.batch_size // len(self.frames)))
            order = np.concatenate([chance.permutation(self.frames) for _ in range(passes)])
        return order if self.targets.device.type == "cpu" else torch.from_numpy(order).to(self.targets.device)

    def to(self, device: Any) -> Self:
        """Move codes and targets to a device, which then draws batches without the host (11 bytes of codes a frame)."""
        self.stores = tuple(store.to(device) for store in self.stores)
        self.targets = self.targets.to(device)
        self.normal = self.normal and tuple(part.to(device) for part in self.normal)
        return self

    def draw(self, batches: Sequence[Any], first: int = 0) -> list[Batch]:
        """Return inputs and targets of batches of frames; ``first`` is the number of the first of them in the
        fit.

        The inputs of a batch come from the store whose turn it is.
        """
        drawn: dict[int, Batch] = {}
        for turn, store in enumerate(self.stores):
            places = [k for k in range(len(batches)) if (first + k) % len(self.stores) == turn]
            if not places:
                continue
            mine = [batches[k] for k in places]
            frames = _joined(mine)
            active, numeric = store.active(frames), self.scaler(store.numeric(frames))
            targets = self.targets[torch.as_tensor(frames)]
            if self.normal:
                targets = targets.sub_(self.normal[0]).div_(self.normal[1])
            parts = torch.as_tensor(active), torch.as_tensor(numeric), targets
            sizes = [len(batch) for batch in mine]
            drawn |= dict(zip(places, zip(*(part.split(sizes) for part in parts), strict=True), strict=True))
        return [drawn[k] for k in range(len(batches))]


def _joined(parts: Sequence[Any]) -> Any:
    if len(parts) == 1:
        return parts[0]
    return np.concatenate(parts) if isinstance(parts[0], np.ndarray) else torch.cat(list(parts))


class Batches(Protocol):
    """What a fit draws from; the order of an epoch depends on nothing but its number."""

    epoch: Callable[[], int]

    @property
    def at_once(self) -> int:
        """Batches that are best drawn at once."""
        ...

    def __len__(self) -> int:
        """The batches of an epoch."""
        ...

    def __iter__(self) -> Iterator[Any]:
        """The batches of an epoch in order."""
        ...

    def blocks(self, at_once: int) -> Iterator[list[Any]]:
        """The batches of an epoch in order, drawn ``at_once`` at a time."""
        ...


class Blocks(IterableDataset):
    """Batches in blocks, for a fit that takes the steps of a block by itself.

    Args:
        batches: of which the blocks are made.
        at_once: batches a block; as many as are drawn at once if left out.
    """

    def __init__(self, batches: Batches, at_once: int = 0) -> None:
        self.batches, self.at_once = batches, at_once or batches.at_once

    def __len__(self) -> int:
        return -(-len(self.batches) // self.at_once)

    def __iter__(self) -> Iterator[list[Any]]:
        return self.batches.blocks(self.at_once)
