"""Layers that are quick where units are bf16 and the processor multiplies it: torch's own take twice as long there."""

from typing import Any

import torch
from torch import Tensor, nn

_MANY = 256
"""Rows of a batch from which laying its columns down as rows costs less than it saves."""


def rounds() -> bool:
    """Whether bf16 is asked for on the processor (``torch.autocast``)."""
    return torch.is_autocast_enabled("cpu") and torch.get_autocast_dtype("cpu") == torch.bfloat16


class Tanh(nn.Tanh):
    """As :class:`torch.nn.Tanh`; bf16 goes to float32 and back, which takes half as long as torch's kernel of bf16."""

    def forward(self, input: Tensor) -> Tensor:
        """Return the units between -1 and 1."""
        if input.device.type != "cpu" or input.dtype != torch.bfloat16:
            return super().forward(input)
        return _Tanh.apply(input)


class _Tanh(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, units: Tensor) -> Tensor:
        """Round what float32 says."""
        told = units.float().tanh_().to(units.dtype)
        ctx.save_for_backward(told)
        return told

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> Tensor:
        """Multiply by ``1 - tanh^2``."""
        return torch.ops.aten.tanh_backward(grads[0], ctx.saved_tensors[0])


class Linear(nn.Linear):
    """As :class:`torch.nn.Linear`; of many bf16 rows the weights' gradient is a product of rows: half the time."""

    def forward(self, input: Tensor) -> Tensor:
        """Return the units (..., out) of inputs (..., in)."""
        if not (self.training and rounds() and torch.is_grad_enabled()):  # first: an export knows no sizes
            return super().forward(input)
        if input.device.type != "cpu" or input.ndim != 2 or len(input) < _MANY:
            return super().forward(input)
        return _Linear.apply(input, self.weight, self.bias)


class _Linear(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, inputs: Tensor, weight: Tensor, bias: Tensor) -> Tensor:
        """Multiply what is rounded."""
        x, w = inputs.bfloat16(), weight.bfloat16()
        ctx.save_for_backward(x, w)
        return torch.addmm(bias.bfloat16(), x, w.t())

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor | None, Tensor, Tensor]:
        """Lay the gradient's columns down as rows before they are multiplied."""
        (x, w), slope = ctx.saved_tensors, grads[0]
        back = slope.mm(w) if ctx.needs_input_grad[0] else None
        return back, slope.t().contiguous().mm(x).float(), slope.sum(0, dtype=torch.float32)
