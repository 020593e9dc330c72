"""The normal equations of parameter generation: a banded matrix for each column, with held edges."""

import math
from typing import Any

import numpy as np
import torch

from dnnvss.curves.banded import Factor, factorise, pad
from dnnvss.curves.windows import Windows, as_tensor
from dnnvss.errors import DnnvssError

_SHORT, _MARGIN = 640, 64
"""Up to so many frames an utterance is not cut; else so many to each side are looked at first."""


def precision_of(variance: Any, mean: torch.Tensor, counts: torch.Tensor | None = None) -> torch.Tensor:
    """Return 1 / variance, float64, with four axes (batch and time may stay 1); zero behind each row's end.

    Args:
        variance: what broadcasts to ``mean``.
        mean: streams (..., T, W, D).
        counts: true frames of each row (B,), or None.

    Raises:
        DnnvssError: a shape that does not broadcast, or a variance that is NaN, zero or negative.
    """
    variance, inside = _spread(variance, mean), None
    if counts is not None:
        inside = (torch.arange(mean.shape[-3], device=variance.device) < counts[:, None])[:, :, None, None]
        if variance.shape[0] > 1 or variance.shape[1] > 1:
            variance = torch.where(inside, variance, 1.0)
    wrong = torch.nonzero(~(variance > 0))
    if len(wrong):
        b, t, w, d = wrong[0].tolist()
        raise DnnvssError(f"variance {variance[b, t, w, d].item()} at row {b}, frame {t}, stream {w}, parameter {d}",
                          remedy="Give positive variances; an infinite one means that the stream says nothing there")
    return variance.reciprocal() * inside if inside is not None else variance.reciprocal()


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


class NormalEquations:
    """The factorised normal equations of a padded batch; frames behind a row's end are unknowns of value zero."""

    def __init__(
        self, precision: torch.Tensor, windows: Windows, counts: torch.Tensor | None, shape: torch.Size
    ) -> None:
        self.precision, self.windows, self.counts, self.shape = precision, windows, counts, shape
        self.bands = self._accumulate(len(precision) if counts is None else shape[0])
        self.factor: Factor = factorise(self.bands, batch=shape[0])
        self._known = dict[int, np.ndarray]()

    def trajectory(self, mean: torch.Tensor) -> torch.Tensor:
        """Return the solution (B, T, D) for means (B, T, W, D)."""
        batch, frames, _, columns = self.shape
        front = 2 * self.windows.reach
        wide = torch.zeros(front + frames + front, batch, columns, dtype=torch.float64, device=mean.device)
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
        x = self.factor.solve(wide).transpose(0, 1)
        if not math.isfinite(x.sum()):
            where = torch.nonzero(~torch.isfinite(mean))
            raise DnnvssError(f"means are not finite, first at (row, frame, stream, parameter) {where[:1].tolist()}",
                              remedy="Check the model that predicted them; training may have diverged")
        return x

    def solve(self, rhs: torch.Tensor) -> torch.Tensor:
        """Return the solution (B, T, D) for right-hand sides (T, B, D)."""
        return self.factor.solve(pad(rhs, 2 * self.windows.reach)).transpose(0, 1)

    def inverse_columns(self, frames: np.ndarray, dead: float) -> tuple[int, np.ndarray]:
        """Return columns of the inverse where they are not dead: the first frame, and (frames from there, len, D).

        For a batch of one. Influence dies out exponentially, so that of a long utterance no more than the surroundings
        are looked at, cut out of the matrix.

        Args:
            frames: which columns, in order of time.
            dead: share of a column's peak below which its end may be cut.
        """
        count, margin = self.shape[1], _MARGIN
        if count <= _SHORT:
            return 0, self._whole_columns(frames)
        while True:
            first, last = max(int(frames[0]) - margin, 0), min(int(frames[-1]) + margin + 1, count)
            if 2 * (last - first) > count:
                first, last = 0, count
            unit = torch.zeros(last - first, len(frames), self.shape[3], dtype=torch.float64, device=self.bands.device)
            unit[torch.as_tensor(frames - first), torch.arange(len(frames))] = 1.0
            factor = self.factor if last - first == count else factorise(self._cut(first, last), batch=len(frames))
            columns = factor.solve(pad(unit, len(self.bands) - 1)).cpu().numpy()
            limit = dead * np.abs(columns).max(axis=0)
            ends = [columns[end] for end, cut in ((0, first > 0), (-1, last < count)) if cut]
            if all((np.abs(end) <= limit).all() for end in ends):
                return first, columns
            margin *= 2

    def _whole_columns(self, frames: np.ndarray) -> np.ndarray:
        """Return columns (T, len, D) of the inverse, those that were asked for before out of memory."""
        fresh = [int(frame) for frame in frames if int(frame) not in self._known]
        if fresh:
            unit = self.bands.new_zeros(self.shape[1] + 2 * (len(self.bands) - 1), len(fresh), self.shape[3])
            unit[torch.as_tensor(fresh) + len(self.bands) - 1, torch.arange(len(fresh))] = 1.0
            columns = self.factor.solve(unit).cpu().numpy()
            self._known |= {frame: columns[:, k] for k, frame in enumerate(fresh)}
            if len(fresh) == len(frames):
                return columns
        return np.stack([self._known[int(frame)] for frame in frames], axis=1)

    def _cut(self, first: int, last: int) -> torch.Tensor:
        """Return the bands of the frames from ``first`` to before ``last``, as if there were no others."""
        cut = self.bands[:, first:last].clone()
        for k in range(1, len(cut)):
            cut[k, max(last - first - k, 0) :] = 0.0
        return cut

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
            own = self.precision[:, :, w].transpose(0, 1).contiguous()  # it is read for every pair of taps
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
        wide[e] = 0.0
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
