"""What makes a fit fast changes nothing: batches on a device, clipping, the precision that a machine has, the step."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from conftest import TABLE
from torch import nn

from dnnvss.errors import DnnvssError
from dnnvss.features import CodeStore, NumericScaler
from dnnvss.systems import Example
from dnnvss.systems.feedforward import FeedForward
from dnnvss.training import FitSettings, precision
from dnnvss.training.allocator import keep_freed_memory
from dnnvss.training.batches import FrameBatches
from dnnvss.training.recipe import descent
from dnnvss.training.regression import FrameRegression

STREAMS, DIMENSIONS = 3, 3
SGD = FitSettings(optimizer="sgd", learning_rate=0.1, stream_weights=(1.0,) * STREAMS, clip=0.25)


def batches(examples: list[Example]) -> FrameBatches:
    store = CodeStore.join((e.id, e.codes) for e in examples)
    targets = np.concatenate([e.targets for e in examples]).reshape(len(store), -1)  # type: ignore[misc]
    return FrameBatches(store, NumericScaler.fit(store), targets, np.arange(len(store)), 64, seed=3)


def test_batches_drawn_on_a_device_are_those_of_the_host(examples: dict[str, list[Example]]) -> None:
    for ours, theirs in zip(batches(examples["train"]).to("cpu"), batches(examples["train"]), strict=True):
        for a, b in zip(ours, theirs, strict=True):
            torch.testing.assert_close(a, b, rtol=1e-6, atol=1e-6)


class Dense(nn.Module):
    """The same network on one-hot columns, of torch's own layers."""

    def __init__(self, network: FeedForward) -> None:
        super().__init__()
        self.table = nn.Parameter(network.first.weight.detach()[:-1].clone())
        self.numeric = nn.Parameter(network.first.numeric_weight.detach().clone())
        self.bias = nn.Parameter(network.first.bias.detach().clone())
        self.rest = nn.Sequential(*(nn.Linear(m.in_features, m.out_features) if isinstance(m, nn.Linear) else nn.Tanh()
                                    for m in network.rest if not isinstance(m, nn.Dropout)))
        for mine, other in zip(self.rest[1::2], network.rest[2::3], strict=True):
            mine.load_state_dict(other.state_dict())

    def forward(self, active: torch.Tensor, numeric: torch.Tensor) -> torch.Tensor:
        """Return the outputs."""
        rows = torch.zeros(len(active), len(self.table) + 1).scatter_(1, active.long(), 1.0)[:, :-1]
        return self.rest(rows @ self.table + numeric @ self.numeric + self.bias)


def test_steps_equal_those_of_a_dense_network_and_plain_sgd(examples: dict[str, list[Example]]) -> None:
    torch.manual_seed(0)
    network = FeedForward(TABLE.binary_width, TABLE.numeric_width, TABLE.active_width, STREAMS * DIMENSIONS, [24, 24])
    objective, recipe, dense = FrameRegression(SGD, STREAMS, DIMENSIONS), descent(SGD), Dense(network)
    fast = recipe.optimizer(network)
    plain = torch.optim.SGD(dense.parameters(), SGD.learning_rate, SGD.momentum)
    clipped = 0
    for active, numeric, target in batches(examples["train"]):
        losses = objective.loss(network, (active, numeric, target)), (dense(active, numeric) - target).square().mean()
        for loss, optimizer in zip(losses, (fast, plain), strict=True):
            optimizer.zero_grad()
            loss.backward()
        recipe.clip(list(network.parameters()))
        clipped += nn.utils.clip_grad_norm_(dense.parameters(), SGD.clip).item() > SGD.clip
        fast.step(), plain.step()
        torch.testing.assert_close(*losses, rtol=1e-4, atol=1e-5)
    assert 0 < clipped < len(batches(examples["train"]))  # both branches were taken
    torch.testing.assert_close(network.first.weight[:-1], dense.table, rtol=1e-4, atol=1e-5)
    assert not network.first.weight[-1].any()


@pytest.mark.parametrize(("hardware", "expected"), [(True, "bf16-mixed"), (False, "32-true")])
def test_precision_follows_the_hardware(hardware: bool, expected: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(precision, "has_bf16", lambda device: hardware)
    assert precision.resolve("auto", "cpu") == expected
    assert precision.resolve("32-true", "cpu") == "32-true"
    if not hardware:
        with pytest.raises(DnnvssError, match="bf16-mixed on a device"):
            precision.resolve("bf16-mixed", "cpu")
    with pytest.raises(DnnvssError, match=r"trainer\.precision=64"):
        replace(SGD, precision="64")


def test_freed_memory_is_kept_where_glibc_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("platform.libc_ver", lambda: ("", ""))
    assert not keep_freed_memory()
    monkeypatch.undo()
    assert keep_freed_memory() == (__import__("platform").libc_ver()[0] == "glibc")
