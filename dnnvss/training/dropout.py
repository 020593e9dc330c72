"""Dropout whose random numbers and masks cost little on the processor."""

from typing import Any

import torch
from torch import Tensor, nn

_MASKS = {torch.float32: torch.int32, torch.bfloat16: torch.int16, torch.float64: torch.int64}
"""Integers as wide as the units."""


class Dropout(nn.Dropout):
    """As :class:`torch.nn.Dropout`, with 16 random bits a unit: 8 for multiples of 1/256, one for a half.

    Torch draws a float from a Mersenne twister for each unit, which takes as long as a third of a bf16 step; here four,
    eight or 64 units share one draw of 64 bits. On other devices torch's own kernel is used.
    """

    def forward(self, input: Tensor) -> Tensor:
        """Return the units, in training a share ``p`` of them zero and the others divided by ``1 - p``."""
        if not self.training or not self.p or input.device.type != "cpu" or input.dtype not in _MASKS:
            return super().forward(input)
        if self.p == 0.5:
            return _Masked.apply(input, halves(input.shape, input.dtype))
        return _Masked.apply(input, factors(keep_mask(input.shape, self.p), 1 / (1 - self.p), input.dtype))


class _Masked(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, units: Tensor, kept: Tensor) -> Tensor:
        """Multiply the units."""
        ctx.save_for_backward(kept)
        return units * kept

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor, None]:
        """Multiply the gradient."""
        return grads[0] * ctx.saved_tensors[0], None


def halves(shape: torch.Size, dtype: torch.dtype) -> Tensor:
    """Return 2 for about half of the places and 0 elsewhere, from torch's seed: a byte tells of eight."""
    count = shape.numel()
    drawn = torch.empty(-(-count // 64), dtype=torch.int64).random_(-(2**63), None).view(torch.uint8).int()
    bits = torch.arange(256)[:, None] >> torch.arange(8) & 1
    return (2 * bits).to(dtype).index_select(0, drawn).view(-1)[:count].view(shape)


def factors(kept: Tensor, scale: float, dtype: torch.dtype) -> Tensor:
    """Return ``scale`` where a unit is kept and zero elsewhere.

    Made by bits, all ones or none under those of the number: a product with a mask of another type takes four times as
    long as one with these.
    """
    whole = _MASKS[dtype]
    return kept.to(whole).neg_().bitwise_and_(torch.tensor(scale, dtype=dtype).view(whole)).view(dtype)


def keep_mask(shape: torch.Size, share: float) -> Tensor:
    """Return a mask (bool) that is False for about ``share`` of its places, from torch's seed."""
    bits = 8 if (share * 256).is_integer() else 16
    count = shape.numel()
    words = torch.empty(-(-count * bits // 64), dtype=torch.int64).random_(-(2**63), None)
    parts = words.view(torch.int8 if bits == 8 else torch.int16)
    return (parts[:count] >= round(share * 2**bits) - 2 ** (bits - 1)).view(shape)
