"""Parameter generation of tensors, with gradients, on the processor and on accelerators."""

from typing import Any

import numpy as np
import torch
from torch.autograd.function import once_differentiable

from dnnvss.curves.equations import NormalEquations, check_positive, check_spread
from dnnvss.curves.windows import Windows, derivatives


def mlpg(mean: torch.Tensor, variance: Any, windows: Windows, lengths: Any) -> torch.Tensor:
    """Return the trajectories (B, T, D), float64, of means (..., T, W, D); see :func:`dnnvss.curves.mlpg.mlpg`.

    Args:
        mean: of one utterance or a padded batch.
        variance: what broadcasts to it.
        windows: the streams.
        lengths: true frames of each row (B,), or None.

    Raises:
        DnnvssError: as there.
    """
    counts = None if lengths is None else torch.as_tensor(lengths, device=mean.device)
    precision = _precision_of(variance, mean, counts)
    mean = mean.reshape(-1, *mean.shape[-3:])
    if torch.is_grad_enabled() and (mean.requires_grad or precision.requires_grad):
        made: torch.Tensor = _Generation.apply(mean.double(), precision, windows, counts)
        return made
    equations = NormalEquations(_kernel(precision), windows, _kernel(counts), tuple(mean.shape))
    return _tensor(equations.trajectory(_kernel(mean)))


def _precision_of(variance: Any, mean: torch.Tensor, counts: torch.Tensor | None) -> torch.Tensor:
    """Return what :func:`dnnvss.curves.equations.precision_of` does, with gradients."""
    spread = torch.as_tensor(variance).to(device=mean.device, dtype=torch.float64)
    check_spread(tuple(spread.shape), tuple(mean.shape))
    if spread.ndim > 3 and mean.ndim != 4:
        spread = spread.expand(mean.shape).reshape(-1, *mean.shape[-3:])
    spread = spread.reshape((1,) * (4 - spread.ndim) + tuple(spread.shape)).expand(-1, -1, *mean.shape[-2:])
    inside = None
    if counts is not None:
        inside = (torch.arange(mean.shape[-3], device=mean.device) < counts[:, None])[:, :, None, None]
        if spread.shape[0] > 1 or spread.shape[1] > 1:
            spread = torch.where(inside, spread, 1.0)
    if not bool((spread > 0).all()):
        check_positive(spread.detach().cpu().numpy())
    return spread.reciprocal() if inside is None else spread.reciprocal() * inside


class _Generation(torch.autograd.Function):
    """MLPG with its gradient: one more solve with the same factor.

    With ``x`` the trajectory, ``g`` the gradient that arrives and ``l = (W' P W)^-1 g``: the means get ``P * (W l)``
    and the precisions ``(W l) * (m - W x)``.
    """

    @staticmethod
    def forward(
        ctx: Any, mean: torch.Tensor, precision: torch.Tensor, windows: Windows, counts: torch.Tensor | None
    ) -> torch.Tensor:
        """Return the trajectory (B, T, D)."""
        ctx.windows, ctx.counts = windows, counts
        ctx.equations = NormalEquations(_kernel(precision), windows, _kernel(counts), tuple(mean.shape))
        x = _tensor(ctx.equations.trajectory(_kernel(mean)))
        ctx.save_for_backward(mean, precision, x)
        return x

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *grads: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, None, None]:
        """Return the gradients of means and precisions."""
        mean, precision, x = ctx.saved_tensors
        incoming = grads[0].transpose(0, 1).contiguous()
        if ctx.counts is not None:
            behind = torch.arange(len(incoming), device=incoming.device)[:, None] >= ctx.counts
            incoming = incoming.masked_fill(behind[..., None], 0.0)
            mean = mean.masked_fill(behind.T[..., None, None], 0.0)
        solved = _tensor(ctx.equations.solve(_kernel(incoming)))
        influence = derivatives(solved, ctx.windows, ctx.counts)
        residual = mean - derivatives(x, ctx.windows, ctx.counts)
        return influence * precision, (influence * residual).sum_to_size(precision.shape), None, None


def _kernel(tensor: torch.Tensor | None) -> Any:
    """Return what the equations calculate with: an array where the tensor lies on the processor."""
    if tensor is None:
        return None
    return tensor.detach() if tensor.is_cuda else tensor.detach().numpy()


def _tensor(array: Any) -> torch.Tensor:
    return torch.from_numpy(np.ascontiguousarray(array)) if isinstance(array, np.ndarray) else array
