"""Quick layers of bf16 units, beside torch's own."""

import torch
from torch import nn

from dnnvss.training.brief import Linear, Tanh


def test_bf16_units_are_those_of_float32_rounded_and_so_is_the_gradient() -> None:
    units = torch.linspace(-6, 6, 1001).bfloat16().requires_grad_()
    told = Tanh()(units)
    assert torch.equal(told, units.detach().float().tanh().bfloat16())
    told.sum().backward()
    assert units.grad is not None
    torch.testing.assert_close(units.grad.float(), 1 - told.detach().float() ** 2, rtol=0.01, atol=1e-6)


def test_other_units_go_to_torch_itself() -> None:
    units = torch.randn(100, dtype=torch.float64, requires_grad=True)
    assert torch.equal(Tanh()(units), units.tanh()) and torch.autograd.gradcheck(Tanh(), units)


def test_a_product_of_bf16_and_its_gradients_are_those_of_torchs_layer() -> None:
    torch.manual_seed(0)
    ours, theirs = Linear(40, 30), nn.Linear(40, 30)
    theirs.load_state_dict(ours.state_dict())
    inputs, slopes = torch.randn(300, 40), torch.randn(300, 30)
    found = []
    for layer in (ours, theirs):
        given = inputs.clone().requires_grad_()
        with torch.autocast("cpu", torch.bfloat16):
            told = layer(given)
        assert told.dtype == torch.bfloat16
        (told * slopes).sum().backward()
        found.append((told, given.grad, layer.weight.grad, layer.bias.grad))
    for mine, other in zip(*found, strict=True):
        torch.testing.assert_close(mine, other, rtol=0.02, atol=0.15)
    assert torch.equal(ours(inputs), theirs(inputs))  # in float32 it is torch's own
