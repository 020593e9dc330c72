"""The normal equations of parameter generation: a banded matrix for each column, with held edges.

Written in what arrays and tensors have in common: tensors are those of an accelerator, see
:mod:`dnnvss.curves.tensors`; all else is NumPy's, and needs no torch.
"""

import math
from typing import Any

import numpy as np

from dnnvss.curves.banded import Factor, factorise
from dnnvss.curves.padding import pad, zeros
from dnnvss.curves.windows import Windows
from dnnvss.errors import DnnvssError

_SHORT, _MARGIN = 640, 64
"""Up to so many frames an utterance is not cut; else so many to each side are looked at first."""


def precision_of(variance: Any, shape: tuple[int, ...], counts: np.ndarray | None = None) -> np.ndarray:
    """Return 1 / variance, float64, with four axes (batch and time may stay 1); zero behind each row's end.

    Args:
        variance: what broadcasts to ``shape``.
        shape: of the streams, (..., T, W, D).
        counts: true frames of each row (B,), or None.

    Raises:
        DnnvssError: a shape that does not broadcast, or a variance that is NaN, zero or negative.
    """
    spread, inside = _spread(np.asarray(variance, np.float64), shape), None
    if counts is not None:
        inside = (np.arange(shape[-3]) < counts[:, None])[:, :, None, None]
        if spread.shape[0] > 1 or spread.shape[1] > 1:
            spread = np.where(inside, spread, 1.0)
    check_positive(spread)
    precision: np.ndarray = 1.0 / spread if inside is None else inside / spread
    return precision


def check_positive(variance: np.ndarray) -> None:
    """Refuse variances (B, T, W, D) that are NaN, zero or negative.

    Raises:
        DnnvssError: there is one.
    """
    if (variance > 0).all():
        return
    b, t, w, d = np.argwhere(~(variance > 0))[0].tolist()
    raise DnnvssError(f"variance {variance[b, t, w, d].item()} at row {b}, frame {t}, stream {w}, parameter {d}",
                      remedy="Give positive variances; an infinite one means that the stream says nothing there")


def check_spread(variance: tuple[int, ...], shape: tuple[int, ...]) -> None:
    """Refuse variances of a shape that does not broadcast to that of the means.

    Raises:
        DnnvssError: it does not.
    """
    try:
        fits = np.broadcast_shapes(variance, shape) == tuple(shape)
    except ValueError:
        fits = False
    if not fits:
        raise DnnvssError(f"variance of shape {tuple(variance)} does not fit means of shape {tuple(shape)}",
                          remedy="Give (W, D), (T, W, D) or the shape of the means")


def _spread(variance: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Return the variances with four axes; a batch or time axis of 1 is kept: what is shared is computed once."""
    check_spread(variance.shape, shape)
    if variance.ndim > 3 and len(shape) != 4:
        variance = np.broadcast_to(variance, shape).reshape(-1, *shape[-3:])
    variance = variance.reshape((1,) * (4 - variance.ndim) + variance.shape)
    return np.broadcast_to(variance, (*variance.shape[:2], *shape[-2:]))


class NormalEquations:
    """The factorised normal equations of a padded batch; frames behind a row's end are unknowns of value zero.

    Args:
        precision: of :func:`precision_of`, or a tensor of an accelerator, and then all that is given and returned is
            one.
        windows: the streams.
        counts: true frames of each row (B,), or None.
        shape: of the batch, (B, T, W, D).
    """

    def __init__(self, precision: Any, windows: Windows, counts: Any, shape: tuple[int, ...]) -> None:
        self.precision, self.windows, self.counts, self.shape = precision, windows, counts, shape
        self.bands = self._accumulate(len(precision) if counts is None else shape[0])
        self.factor: Factor = factorise(self.bands, batch=shape[0])
        self._known = dict[int, np.ndarray]()

    def trajectory(self, mean: Any) -> Any:
        """Return the solution (B, T, D) for means (B, T, W, D)."""
        batch, frames, _, columns = self.shape
        front, behind = 2 * self.windows.reach, self._behind
        wide = zeros(self.precision, front + frames + front, batch, columns)
        for w in range(len(self.windows)):
            weighted = (mean[:, :, w] * self.precision[:, :, w]).swapaxes(0, 1)
            if behind is not None:
                weighted[behind] = 0.0
            for s, weight in self.windows.weights(w):
                wide[front + s : front + s + frames] += weighted if weight == 1 else weight * weighted
        _fold_vector(wide, front, self._last(front), self.windows.reach)
        x = self.factor.solve(wide).swapaxes(0, 1)
        if not math.isfinite(x.sum()):
            where = np.argwhere(~np.isfinite(mean if isinstance(mean, np.ndarray) else mean.cpu().numpy()))
            raise DnnvssError(f"means are not finite, first at (row, frame, stream, parameter) {where[:1].tolist()}",
                              remedy="Check the model that predicted them; training may have diverged")
        return x

    def solve(self, rhs: Any) -> Any:
        """Return the solution (B, T, D) for right-hand sides (T, B, D)."""
        return self.factor.solve(pad(rhs, 2 * self.windows.reach)).swapaxes(0, 1)

    @property
    def _behind(self) -> Any:
        """Which frames (T, B) lie behind the end of their row; None where no row ends before the others."""
        if self.counts is None:
            return None
        frames = np.arange(self.shape[1])[:, None]
        return (frames if isinstance(self.counts, np.ndarray) else self.counts.new_tensor(frames)) >= self.counts

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
            unit = np.zeros((last - first, len(frames), self.shape[3]))
            unit[frames - first, np.arange(len(frames))] = 1.0
            factor = self.factor if last - first == count else factorise(self._cut(first, last), batch=len(frames))
            columns = factor.solve(pad(unit, len(self.bands) - 1))
            limit = dead * np.abs(columns).max(axis=0)
            ends = [columns[end] for end, cut in ((0, first > 0), (-1, last < count)) if cut]
            if all((np.abs(end) <= limit).all() for end in ends):
                return first, columns
            margin *= 2

    def _whole_columns(self, frames: np.ndarray) -> np.ndarray:
        """Return columns (T, len, D) of the inverse, those that were asked for before out of memory."""
        fresh = [int(frame) for frame in frames if int(frame) not in self._known]
        if fresh:
            unit = np.zeros((self.shape[1] + 2 * (len(self.bands) - 1), len(fresh), self.shape[3]))
            unit[np.asarray(fresh) + len(self.bands) - 1, np.arange(len(fresh))] = 1.0
            columns = self.factor.solve(unit)
            self._known |= {frame: columns[:, k] for k, frame in enumerate(fresh)}
            if len(fresh) == len(frames):
                return columns
        return np.stack([self._known[int(frame)] for frame in frames], axis=1)

    def _cut(self, first: int, last: int) -> np.ndarray:
        """Return the bands of the frames from ``first`` to before ``last``, as if there were no others."""
        cut = self.bands[:, first:last].copy()
        for k in range(1, len(cut)):
            cut[k, max(last - first - k, 0) :] = 0.0
        return cut

    def _last(self, front: int) -> Any:
        """Return the extended index of the last true frame: a number, or one for each row."""
        if self.counts is None:
            return front + self.shape[1] - 1
        return self.counts + (front - 1)

    def _accumulate(self, batch: int) -> Any:
        """Return the bands (K + 1, T, batch, D) of W' V^-1 W."""
        windows, frames, columns, behind = self.windows, self.shape[1], self.shape[3], self._behind
        reach, front = windows.reach, 2 * windows.reach
        wide = zeros(self.precision, front + 1, front + frames + reach, batch, columns)
        for w in range(len(windows)):
            weights = windows.weights(w)
            own = self.precision[:, :, w].swapaxes(0, 1)
            for s, first in weights:
                for r, second in weights:
                    if r >= s:
                        wide[r - s, front + s : front + s + frames] += own * (first * second)
        _fold_matrix(wide, front, self._last(front), reach)
        bands = wide[:, front : front + frames]
        if behind is not None:
            bands[0][behind] = 1.0
        return bands


def _rows(last: Any) -> Any:
    """Return the index that pairs each row of the batch with its own last frame."""
    if isinstance(last, int):
        return slice(None)
    return np.arange(len(last)) if isinstance(last, np.ndarray) else last.new_tensor(range(len(last)))


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
