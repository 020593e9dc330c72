"""A training step that a GPU has recorded and replays by itself."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import torch
from torch import Tensor

from dnnvss.training.batches import Batch

_WARM = 3  # steps before the recording: the optimiser makes its state, libraries choose their kernels


class GraphedStep:
    """Calls ``step`` for the first batches, then records it as a CUDA graph and replays that.

    A step of a feed-forward network is a hundred small kernels; the host takes longer to ask for them than the GPU to
    run them, unless the batch is large. A replay asks once.

    Args:
        step: takes a batch, waits for no result, and keeps nothing of its own on the host; no batch says nothing.
        optimizer: the one that ``step`` uses; its learning rates may change between calls.
    """

    def __init__(self, step: Callable[[Batch], bool], optimizer: torch.optim.Optimizer) -> None:
        self.step, self.optimizer = step, optimizer
        self.calls, self.graph = 0, torch.cuda.CUDAGraph()
        self.inputs: Batch | None = None
        self.rates: list[Tensor] = []

    def __call__(self, batch: Batch) -> bool:
        """Take a step, and tell that it was taken; all batches have the shapes of the first."""
        if self.inputs is None:
            active, numeric, target = batch
            self.inputs = active.clone(), numeric.clone(), target.clone()
        for ours, given in zip(self.inputs, batch, strict=True):
            ours.copy_(given)
        if self.calls < _WARM:
            self._warm(self.inputs)
        else:
            if self.calls == _WARM:
                self._record(self.inputs)
            for rate, group in zip(self.rates, self.optimizer.param_groups, strict=True):
                rate.fill_(group["lr"])
            self.graph.replay()
        self.calls += 1
        return True

    def _warm(self, inputs: Batch) -> None:
        side = torch.cuda.Stream()  # a recording must not meet work of the default stream
        side.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(side):
            self.step(inputs)
        torch.cuda.current_stream().wait_stream(side)

    def _record(self, inputs: Batch) -> None:
        self.rates = [torch.zeros((), device=inputs[-1].device) for _ in self.optimizer.param_groups]
        with _recordable(self.optimizer, self.rates), torch.cuda.graph(self.graph):
            self.step(inputs)


@contextmanager
def _recordable(optimizer: torch.optim.Optimizer, rates: list[Tensor]) -> Iterator[None]:
    """Let the optimiser read its learning rates from the GPU, where each replay finds the present ones."""
    kept = [dict(group) for group in optimizer.param_groups]
    for group, rate in zip(optimizer.param_groups, rates, strict=True):
        group["lr"] = rate
        if "capturable" in group:
            group["capturable"] = True
    try:
        yield
    finally:
        for group, before in zip(optimizer.param_groups, kept, strict=True):
            group.update(before)
