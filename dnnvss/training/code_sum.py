"""The sum of the rows of active columns, with a gradient that costs no more than the sum itself."""

from typing import Any

import numpy as np
import torch
from torch import Tensor

from dnnvss.training.brief import rounds

_WORTH = 4
"""Active columns for each row of the weights from which rounding all of them costs less than it saves."""
_TOGETHER = 256
"""Columns whose gradients are summed at once and brought to float32 while they lie in the cache."""


def code_sum(active: Tensor, weight: Tensor) -> Tensor:
    """Return the sums (B, H) of the rows of ``weight`` (C + 1, H) at the active columns (B, A).

    Row C is that of padding: zero, and without a gradient. In training on the processor the gradient is summed column
    by column, each from the frames in which it is active, so that every row of it is written once, by one thread; the
    frames are a few MB and stay in the cache. Equal to the dense product to rounding; where bf16 is asked for
    (``torch.autocast``) and the batch is large, weights and gradients are read as bf16 and added up as float32.

    Args:
        active: int32 columns, C where there is none.
        weight: float32 or float64.
    """
    padding = weight.shape[0] - 1
    if not active.shape[1]:  # a table of numbers alone; embedding_bag refuses empty bags
        return weight[active.long()].sum(1)
    if weight.device.type != "cpu" or not (torch.is_grad_enabled() and weight.requires_grad):
        return torch.nn.functional.embedding_bag(active, weight, mode="sum", padding_idx=padding)
    brief = rounds() and active.numel() > _WORTH * len(weight)
    return _CodeSum.apply(active, weight, torch.bfloat16 if brief else weight.dtype)


class _CodeSum(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, active: Tensor, weight: Tensor, dtype: torch.dtype) -> Tensor:
        """Sum without ``padding_idx``, which would forbid torch's fast kernel; the row of padding is zero."""
        ctx.save_for_backward(active)
        ctx.like, ctx.dtype = weight, dtype
        return torch.nn.functional.embedding_bag(active, weight.to(dtype), mode="sum")

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[None, Tensor, None]:
        """Sum, for each column, the gradients of the frames in which it is active; rounded ones for some at a time."""
        (active,) = ctx.saved_tensors
        frames, starts = map(torch.from_numpy, by_column(active.numpy(), len(ctx.like) - 1))
        if ctx.dtype == ctx.like.dtype:
            return None, torch.nn.functional.embedding_bag(frames, grads[0].contiguous(), starts, mode="sum"), None
        given, grad = grads[0].to(ctx.dtype).contiguous(), torch.empty_like(ctx.like)
        ends = [*starts[_TOGETHER::_TOGETHER].tolist(), len(frames)]
        first = 0
        for rows, own, end in zip(grad.split(_TOGETHER), starts.split(_TOGETHER), ends, strict=True):
            rows.copy_(torch.nn.functional.embedding_bag(frames[first:end], given, own - first, mode="sum"))
            first = end
        return None, grad, None


def by_column(active: np.ndarray, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the frames in which each column is active, one column after the other, and where each begins (C + 1,).

    Args:
        active: (B, A) columns, ``columns`` where there is none.
        columns: C; the last start, that of padding, is the number of frames in the list.
    """
    flat = active.ravel()
    if columns < np.iinfo(np.uint16).max:
        flat = flat.astype(np.uint16)  # NumPy sorts two bytes by counting, five times faster
    counts = np.bincount(flat, minlength=columns + 1)
    starts = np.cumsum(counts) - counts
    order = np.argsort(flat, kind="stable")[: starts[-1]]
    return (order // active.shape[1]).astype(np.int32), starts.astype(np.int32)
