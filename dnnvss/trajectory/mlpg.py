"""Maximum-likelihood parameter generation: the smooth trajectory that the predicted streams make most likely."""

import math
from typing import Any

import numpy as np
import torch
from torch.autograd.function import once_differentiable

from dnnvss.errors import DnnvssError
from dnnvss.trajectory.banded import Factor, factorise
from dnnvss.trajectory.windows import STATIC_DELTA_DELTA2, Array, Windows, as_tensor, derivatives


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
    spread = _spread(variance, given)
    counts = _check_lengths(lengths, batched) if lengths is not None else None
    precision = _precision(spread, counts, batched.shape)
    if torch.is_grad_enabled() and (given.requires_grad or spread.requires_grad):
        x = _Generation.apply(batched.double(), precision, windows, counts)
    else:
        x = _Equations(precision, windows, counts, batched.shape).trajectory(batched)
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


def _spread(variance: Any, mean: torch.Tensor) -> torch.Tensor:
    """Return the variances with four axes; a batch or time axis of 1 is kept: what is shared is computed once."""
    spread = as_tensor(variance).to(device=mean.device, dtype=torch.float64)
    try:
        torch.broadcast_to(spread, mean.shape)
    except RuntimeError:
        raise DnnvssError(f"variance of shape {tuple(spread.shape)} does not fit means of shape {tuple(mean.shape)}",
                          remedy="Give (W, D), (T, W, D) or the shape of the means") from None
    if spread.ndim > 3 and mean.ndim != 4:
        spread = spread.expand(mean.shape).reshape(-1, *mean.shape[-3:])
    spread = spread.reshape((1,) * (4 - spread.ndim) + tuple(spread.shape))
    return spread.expand(-1, -1, *mean.shape[-2:])


def _check_lengths(lengths: Any, mean: torch.Tensor) -> torch.Tensor:
    counts = torch.as_tensor(lengths, device=mean.device)
    if counts.shape != mean.shape[:1] or bool((counts < 1).any() | (counts > mean.shape[1]).any()):
        raise DnnvssError(f"lengths {counts.tolist()} do not fit {mean.shape[0]} rows of {mean.shape[1]} frames",
                          remedy="Give each row a length between 1 and the padded number of frames")
    return counts.long()


def _precision(variance: torch.Tensor, counts: torch.Tensor | None, shape: torch.Size) -> torch.Tensor:
    """Return 1 / variance with four axes (those of size 1 kept), zero behind each row's end."""
    inside = None
    if counts is not None:
        inside = (torch.arange(shape[1], device=variance.device) < counts[:, None])[:, :, None, None]
        if variance.shape[0] > 1 or variance.shape[1] > 1:
            variance = torch.where(inside, variance, 1.0)
    wrong = torch.nonzero(~(variance > 0))
    if len(wrong):
        b, t, w, d = wrong[0].tolist()
        raise DnnvssError(f"variance {variance[b, t, w, d].item()} at row {b}, frame {t}, stream {w}, parameter {d}",
                          remedy="Give positive variances; an infinite one means that the stream says nothing there")
    return variance.reciprocal() * inside if inside is not None else variance.reciprocal()


class _Equations:
    """The factorised normal equations of a padded batch; frames behind a row's end are unknowns of value zero."""

    def __init__(
        self, precision: torch.Tensor, windows: Windows, counts: torch.Tensor | None, shape: torch.Size
    ) -> None:
        self.precision, self.windows, self.counts, self.shape = precision, windows, counts, shape
        bands = self._accumulate(len(precision) if counts is None else shape[0])
        self.factor: Factor = factorise(bands, batch=shape[0])

    def trajectory(self, mean: torch.Tensor) -> torch.Tensor:
        """Return the solution (B, T, D) for means (B, T, W, D)."""
        batch, frames, _, columns = self.shape
        front = 2 * self.windows.reach
        wide = torch.zeros(front + frames + self.windows.reach, batch, columns, dtype=torch.float64, device=mean.device)
        weighted = wide.new_empty(frames, batch, columns)
        for w in range(len(self.windows)):
            stream = mean[:, :, w]
            if self.counts is not None:
                behind = torch.arange(frames, device=mean.device) >= self.counts[:, None]
                stream = stream.masked_fill(behind[..., None], 0.0)
            torch.mul(stream.transpose(0, 1), self.precision[:, :, w].transpose(0, 1), out=weighted)
            for s, weight in self.windows.weights(w):
                wide[front + s : front + s + frames].add_(weighted, alpha=weight)
        _fold_vector(_indexable(wide), front, self._last(front), self.windows.reach)
        x = self.solve(wide[front : front + frames])
        if not math.isfinite(x.sum()):
            where = torch.nonzero(~torch.isfinite(mean))
            raise DnnvssError(f"means are not finite, first at (row, frame, stream, parameter) {where[:1].tolist()}",
                              remedy="Check the model that predicted them; training may have diverged")
        return x

    def solve(self, rhs: torch.Tensor) -> torch.Tensor:
        """Return the solution (B, T, D) for right-hand sides (T, B, D)."""
        return self.factor.solve(rhs).transpose(0, 1)

    def _last(self, front: int) -> Any:
        """Return the extended index of the last true frame: a number, or one for each row."""
        if self.counts is None:
            return front + self.shape[1] - 1
        return _indexable(self.counts) + (front - 1)

    def _accumulate(self, batch: int) -> torch.Tensor:
        """Return the bands (K + 1, T, batch, D) of W' V^-1 W."""
        windows, frames, columns = self.windows, self.shape[1], self.shape[3]
        reach, front = windows.reach, 2 * windows.reach
        wide = self.precision.new_zeros(front + 1, front + frames + reach, batch, columns)
        for w in range(len(windows)):
            weights = windows.weights(w)
            own = self.precision[:, :, w].transpose(0, 1)
            for s, first in weights:
                for r, second in weights:
                    if r >= s:
                        wide[r - s, front + s : front + s + frames].add_(own, alpha=first * second)
        _fold_matrix(_indexable(wide), front, self._last(front), reach)
        bands = wide[:, front : front + frames]
        if self.counts is not None:
            behind = torch.arange(frames, device=bands.device)[:, None] >= self.counts
            bands[0].masked_fill_(behind[..., None], 1.0)
        return bands


def _indexable(array: torch.Tensor) -> Any:
    """Return a numpy view where there is one: indexing single frames costs a tenth there."""
    return array if array.is_cuda else array.numpy()


def _rows(last: Any) -> Any:
    """Return the index that pairs each row of the batch with its own last frame."""
    if isinstance(last, int):
        return slice(None)
    return torch.arange(len(last), device=last.device) if isinstance(last, torch.Tensor) else np.arange(len(last))


def _fold_vector(wide: Any, first: int, last: Any, reach: int) -> None:
    """Add what fell on frames outside an utterance to the end frame that is held in their place."""
    for e in range(first - reach, first):
        wide[first] += wide[e]
    rows = _rows(last)
    for j in range(1, reach + 1):
        wide[last, rows] += wide[last + j, rows]
        wide[last + j, rows] = 0.0


def _fold_matrix(wide: Any, first: int, last: Any, reach: int) -> None:
    """Do the same for the bands of the matrix, both for rows and for columns."""
    for e in range(first - reach, first):
        for k in range(2 * reach + 1):
            target = max(e + k, first)
            wide[target - first, first] += wide[k, e] * (2.0 if k and target == first else 1.0)
    wide[:, :first] = 0.0
    rows = _rows(last)
    for j in range(1 - 2 * reach, reach + 1):  # row last + j, column last + j + k
        for k in range(max(1 - j, 0), 2 * reach + 1):
            if j + k <= reach:
                source = wide[k, last + j, rows]
                wide[max(-j, 0), last + min(j, 0), rows] += source * (2.0 if k and j >= 0 else 1.0)
                wide[k, last + j, rows] = 0.0


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
        ctx.equations = _Equations(precision.detach(), windows, counts, mean.shape)
        x = ctx.equations.trajectory(mean.detach())
        ctx.save_for_backward(mean, precision, x)
        return x

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *grads: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, None, None]:
        """Return the gradients of means and precisions."""
        mean, precision, x = ctx.saved_tensors
        equations: _Equations = ctx.equations
        incoming = grads[0].transpose(0, 1).contiguous()
        if equations.counts is not None:
            behind = torch.arange(len(incoming), device=incoming.device)[:, None] >= equations.counts
            incoming = incoming.masked_fill(behind[..., None], 0.0)
            mean = mean.masked_fill(behind.T[..., None, None], 0.0)
        influence = derivatives(equations.solve(incoming), equations.windows, equations.counts)
        residual = mean - derivatives(x, equations.windows, equations.counts)
        return influence * precision, (influence * residual).sum_to_size(precision.shape), None, None
