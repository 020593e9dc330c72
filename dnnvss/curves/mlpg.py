"""Maximum-likelihood parameter generation: the smooth trajectory that the predicted streams make most likely."""

from typing import Any

import torch
from torch.autograd.function import once_differentiable

from dnnvss.curves.equations import NormalEquations, precision_of
from dnnvss.curves.windows import STATIC_DELTA_DELTA2, Array, Windows, as_tensor, derivatives
from dnnvss.errors import DnnvssError


def mlpg(
    mean: Array,
    variance: Array | float,
    windows: Windows = STATIC_DELTA_DELTA2,
    lengths: Array | list[int] | None = None,
) -> Array:
    """Return the most likely trajectory, shape (..., T, D), of the kind, dtype and device of ``mean``.

    Each column ``d`` is solved on its own from the normal equations

    ``(W' V^-1 W) x = W' V^-1 m``,

    where ``W`` stacks the windows with held edges (:class:`Windows`), ``m`` the means and ``V`` the diagonal of
    variances. The matrix has twice the windows' reach in bands beside its diagonal, so time and memory are linear in
    T. The equations are solved in float64 whatever the dtype. Gradients flow to means and variances (first order).

    Args:
        mean: predicted streams (..., T, W, D), numpy or torch.
        variance: variances that broadcast to ``mean``, e.g. (W, D), (T, W, D) or (B, 1, W, D); infinite means "says
            nothing".
        windows: the streams, W of them.
        lengths: for a padded batch (B, T, W, D), the number of true frames of each row, shape (B,). Frames behind it
            may hold anything and come back as zeros; each row equals its solution alone.

    Raises:
        DnnvssError: shapes that do not fit, no frames, means that are not finite, variances that are NaN, zero or
            negative, or so many infinite variances that a frame is not determined.

    **Source**: Tokuda et al., Speech parameter generation algorithms for HMM-based speech synthesis (2000), section
    3.1, equation 13; Thangthai et al. 2016, section 2.
    """
    given = as_tensor(mean)
    _check_shapes(given, windows)
    shape = given.shape
    batched = given.reshape(-1, *shape[-3:])
    counts = _check_lengths(lengths, batched) if lengths is not None else None
    precision = precision_of(variance, given, counts)
    if torch.is_grad_enabled() and (given.requires_grad or precision.requires_grad):
        x = _Generation.apply(batched.double(), precision, windows, counts)
    else:
        x = NormalEquations(precision, windows, counts, batched.shape).trajectory(batched)
    x = x.reshape(*shape[:-2], shape[-1]).to(given.dtype)
    return x if isinstance(mean, torch.Tensor) else x.numpy()  # type: ignore[return-value]


def _check_shapes(mean: torch.Tensor, windows: Windows) -> None:
    if mean.ndim < 3 or mean.shape[-2] != len(windows) or 0 in mean.shape:
        raise DnnvssError(
            f"means have the shape {tuple(mean.shape)}, not (frames, {len(windows)} streams, parameters)",
            remedy=f"Give one frame or more of the streams {', '.join(windows.names)}, or other windows",
        )
    if not mean.is_floating_point():
        raise DnnvssError(f"means are {mean.dtype}", remedy="Give floating-point means")


def _check_lengths(lengths: Any, mean: torch.Tensor) -> torch.Tensor:
    counts = torch.as_tensor(lengths, device=mean.device)
    if counts.shape != mean.shape[:1] or bool((counts < 1).any() | (counts > mean.shape[1]).any()):
        raise DnnvssError(f"lengths {counts.tolist()} do not fit {mean.shape[0]} rows of {mean.shape[1]} frames",
                          remedy="Give each row a length between 1 and the padded number of frames")
    return counts.long()


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
        ctx.equations = NormalEquations(precision.detach(), windows, counts, mean.shape)
        x = ctx.equations.trajectory(mean.detach())
        ctx.save_for_backward(mean, precision, x)
        return x

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *grads: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, None, None]:
        """Return the gradients of means and precisions."""
        mean, precision, x = ctx.saved_tensors
        equations: NormalEquations = ctx.equations
        incoming = grads[0].transpose(0, 1).contiguous()
        if equations.counts is not None:
            behind = torch.arange(len(incoming), device=incoming.device)[:, None] >= equations.counts
            incoming = incoming.masked_fill(behind[..., None], 0.0)
            mean = mean.masked_fill(behind.T[..., None, None], 0.0)
        influence = derivatives(equations.solve(incoming), equations.windows, equations.counts)
        residual = mean - derivatives(x, equations.windows, equations.counts)
        return influence * precision, (influence * residual).sum_to_size(precision.shape), None, None
