"""Dropout whose random numbers cost little on the processor."""

from typing import Any

import torch
from torch import Tensor, nn

_BITS = 16


class Dropout(nn.Dropout):
    """As :class:`torch.nn.Dropout`, with masks of 16 random bits a unit: the share is a multiple of 1/65536.

    Torch draws a float from a Mersenne twister for each unit, which takes as long as a third of a bf16 step; here four
    units share one draw of 64 bits. On other devices torch's own kernel is used.
    """

    def forward(self, input: Tensor) -> Tensor:
        """Return the units, in training a share ``p`` of them zero and the others divided by ``1 - p``."""
        if not self.training or not self.p or input.device.type != "cpu":
            return super().forward(input)
        return _Masked.apply(input, keep_mask(input.shape, self.p), 1 / (1 - self.p))


class _Masked(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, units: Tensor, kept: Tensor, scale: float) -> Tensor:
        """Multiply in place of torch's float mask, which is four times the memory."""
        ctx.save_for_backward(kept)
        ctx.scale = scale
        return units.mul(kept).mul_(scale)

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor, None, None]:
        """Pass the gradient of the units that were kept."""
        return grads[0].mul(ctx.saved_tensors[0]).mul_(ctx.scale), None, None


def keep_mask(shape: torch.Size, share: float) -> Tensor:
    """Return a mask (bool) that is False for about ``share`` of its places, from torch's seed."""
    count = shape.numel()
    words = torch.empty(-(-count * _BITS // 64), dtype=torch.int64).random_(-(2**63), None)
    threshold = round(share * 2**_BITS) - 2 ** (_BITS - 1)
    return (words.view(torch.int16)[:count] >= threshold).view(shape)
