"""The network: its first layer against a dense one, its gradient, and its shape by configuration."""

import pytest
import torch

from dnnvss.errors import DnnvssError
from dnnvss.systems.feedforward import CodeLinear, FeedForward

BINARY, NUMERIC = 11, 2


def dense(active: torch.Tensor) -> torch.Tensor:
    rows = torch.zeros(len(active), BINARY + 1, dtype=torch.float64)
    rows.scatter_(1, active.long(), 1.0)
    return rows[:, :BINARY]


@pytest.fixture
def layer() -> CodeLinear:
    torch.manual_seed(0)
    layer = CodeLinear(BINARY, NUMERIC, 5).double()
    layer.reset(3)
    return layer


def test_code_linear_equals_dense_layer(layer: CodeLinear) -> None:
    active = torch.tensor([[0, 4, BINARY], [3, 9, 10], [BINARY, BINARY, BINARY]], dtype=torch.int32)
    numeric = torch.randn(3, NUMERIC, dtype=torch.float64)
    expected = dense(active) @ layer.weight[:BINARY] + numeric @ layer.numeric_weight + layer.bias
    torch.testing.assert_close(layer(active, numeric), expected)


def test_code_linear_gradient_equals_dense_layer(layer: CodeLinear) -> None:
    active = torch.tensor([[0, 4, BINARY], [3, 4, 10]], dtype=torch.int32)
    numeric = torch.randn(2, NUMERIC, dtype=torch.float64)
    layer(active, numeric).square().sum().backward()
    weight = layer.weight.detach()[:BINARY].clone().requires_grad_()
    (dense(active) @ weight + numeric @ layer.numeric_weight.detach() + layer.bias.detach()).square().sum().backward()
    torch.testing.assert_close(layer.weight.grad[:BINARY], weight.grad)
    assert not layer.weight.grad[BINARY].any()  # padding learns nothing


def test_widths_and_activation_follow_the_configuration() -> None:
    network = FeedForward(BINARY, NUMERIC, active=3, out=6, hidden=[7, 4], activation="relu", dropout=0.5)
    kinds = [type(m).__name__ for m in network.rest]
    assert kinds == ["ReLU", "Dropout", "Linear", "ReLU", "Dropout", "Linear"]
    assert network(torch.zeros(2, 3, dtype=torch.int32), torch.zeros(2, NUMERIC)).shape == (2, 6)


def test_first_layer_starts_at_unit_scale() -> None:
    torch.manual_seed(0)
    layer = CodeLinear(2000, 0, 400)
    layer.reset(50)
    active = torch.randint(0, 2000, (256, 50), dtype=torch.int32)
    deviation = layer(active, torch.zeros(256, 0)).std().item()
    assert deviation == pytest.approx((50 * 2 / 450) ** 0.5, rel=0.05)  # Glorot: variance 2 / (in + out) a weight


@pytest.mark.parametrize("wrong", [{"hidden": []}, {"hidden": [0]}, {"activation": "softsign"}, {"dropout": 1.0}])
def test_what_makes_no_network_is_refused(wrong: dict) -> None:
    with pytest.raises(DnnvssError):
        FeedForward(BINARY, NUMERIC, active=3, out=6, **wrong)
