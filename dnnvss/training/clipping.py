"""Gradients whose norm is too large are scaled."""

from collections.abc import Sequence

import torch
from torch import Tensor, nn


def clip_quickly(parameters: Sequence[nn.Parameter], most: float) -> None:
    """Scale all gradients where their norm is above ``most``; on the processor others are not touched."""
    grads = _gradients(parameters)
    if grads[0].device.type != "cpu":
        shrink = most / (nn.utils.get_total_norm(grads) + 1e-6)
        torch._foreach_mul_(grads, shrink.clamp(max=1))
        return
    flat = [g.flatten() for g in grads]  # a product with itself takes half as long as torch's norm
    shrink = most / (torch.stack([g.dot(g) for g in flat]).sum().sqrt() + 1e-6)
    if shrink < 1:
        torch._foreach_mul_(grads, shrink)


def clip_each(parameters: Sequence[nn.Parameter], most: float) -> None:
    """As :func:`clip_quickly`, for each of the networks along the first dimension of the parameters by itself."""
    grads = _gradients(parameters)
    norms = torch.stack([torch.linalg.vector_norm(g.flatten(1), dim=1) for g in grads])
    shrink = (most / (torch.linalg.vector_norm(norms, dim=0) + 1e-6)).clamp(max=1)
    for grad in grads:
        grad.mul_(shrink.view(-1, *[1] * (grad.ndim - 1)))


def clip_as_torch(parameters: Sequence[nn.Parameter], most: float) -> None:
    """Scale all gradients where their norm is above ``most``, with torch's own function."""
    nn.utils.clip_grad_norm_(parameters, most)


def _gradients(parameters: Sequence[nn.Parameter]) -> list[Tensor]:
    return [p.grad for p in parameters if p.grad is not None]
