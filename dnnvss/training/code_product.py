"""The first layer as one dense product, for devices whose matrix products cost less than their memory."""

from typing import Any

import torch
from torch import Tensor


def multiplies(weight: Tensor) -> bool:
    """Return whether a device does better with a dense product than with a sum of the rows of active columns.

    GPUs do, the more so the larger the batch. Processors do not, not even one with bf16 products (AMX).
    """
    return weight.device.type == "cuda"


def code_product(active: Tensor, numeric: Tensor, weight: Tensor, numeric_weight: Tensor, bias: Tensor) -> Tensor:
    """Return ``one-hot @ weight + numeric @ numeric_weight + bias`` (B, H), expanded and multiplied in one piece.

    All may have a dimension more in front, for several layers at once.

    Args:
        active: int32 columns (B, A), C where there is none.
        numeric: (B, N).
        weight: (C + 1, H), its last row that of padding, which neither counts nor gets a gradient.
        numeric_weight, bias: (N, H), (H,).
    """
    kind = weight.device.type
    dtype = torch.get_autocast_dtype(kind) if torch.is_autocast_enabled(kind) else weight.dtype
    return _CodeProduct.apply(active, numeric, weight, numeric_weight, bias, dtype)


class _CodeProduct(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, active: Tensor, numeric: Tensor, weight: Tensor, numeric_weight: Tensor, bias: Tensor,
                dtype: torch.dtype) -> Tensor:
        """Multiply; the weights are copied into one matrix of the products' type, which autocast would do too."""
        columns, numbers = weight.shape[-2], numeric_weight.shape[-2]
        inner = -(-(columns + numbers + 1) // 8) * 8  # multiples of 16 bytes, as fast products ask for
        inputs = torch.zeros(*active.shape[:-1], inner, device=weight.device, dtype=dtype)
        inputs.scatter_(-1, active.long(), 1)
        inputs[..., columns - 1] = 0
        inputs[..., columns : columns + numbers] = numeric
        inputs[..., columns + numbers] = 1
        weights = torch.zeros(*weight.shape[:-2], inner, weight.shape[-1], device=weight.device, dtype=dtype)
        for part, start in ((weight, 0), (numeric_weight, columns), (bias[..., None, :], columns + numbers)):
            weights[..., start : start + part.shape[-2], :] = part
        ctx.save_for_backward(inputs)
        ctx.parts, ctx.dtype = (columns, numbers, 1, inner - columns - numbers - 1), weight.dtype
        return inputs @ weights

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor | None, ...]:
        """Return the gradients of the weights, parts of one product."""
        (inputs,) = ctx.saved_tensors
        weight, numeric, bias, _ = (inputs.mT @ grads[0]).to(ctx.dtype).split(ctx.parts, dim=-2)
        return None, None, weight, numeric, bias[..., 0, :], None
