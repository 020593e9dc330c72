"""Features without what belongs to a voice, a room or a microphone: their mean and deviation taken out."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import islice

import numpy as np

from dnnvss.media import Sound

HOW = ("none", "talker", "recording", "running")
"""Over what they are taken: nothing, all recordings of the talker, the recording, what was heard of it."""
_SECONDS = 1.0  # of the usual deviation, that count as heard before a recording begins
_LEAST = 1e-2  # share of the usual deviation that every deviation has at least
_RECORDINGS = 100  # of a talker, that are listened to at most


@dataclass(frozen=True)
class Moments:
    """Mean and deviation of each column, both (C,)."""

    mean: np.ndarray
    deviation: np.ndarray

    @classmethod
    def of(cls, parts: Iterable[np.ndarray], spread: float) -> "Moments":
        """Those of rows (n, C), in parts that are looked at one after the other.

        Args:
            parts: at least one row in all.
            spread: the usual deviation of a column, of which each has a hundredth at least.
        """
        count, total, square = 0, 0.0, 0.0
        for part in parts:
            rows = part.astype(np.float64)
            count, total, square = count + len(rows), total + rows.sum(axis=0), square + (rows**2).sum(axis=0)
        mean = np.asarray(total / count)
        variance = np.maximum(square / count - mean**2, 0)
        return cls(mean, np.maximum(np.sqrt(variance), _LEAST * spread))

    def __call__(self, rows: np.ndarray) -> np.ndarray:
        """Rows (n, C) with the mean taken off, over the deviation."""
        return ((rows - self.mean) / self.deviation).astype(rows.dtype)


class Running:
    """Rows less the mean of those so far, over their deviation: what can be done as they come.

    ``m_k`` is the mean of rows 0 to k; the variance is that about ``m_k``, to which a second of the
    usual one is added: ``(w s^2 + sum_i (x_i - m_k)^2) / (w + k + 1)``.

    Args:
        spread: the usual deviation s of a column.
        rate: rows a second; a second of them is w.
    """

    def __init__(self, spread: float, rate: float) -> None:
        self.spread, self.weight = spread, _SECONDS * rate
        self._count, self._first, self._sums = 0, np.zeros(0), np.zeros((2, 0))

    def push(self, rows: np.ndarray) -> np.ndarray:
        """The next rows (n, C), normalised, of the same type."""
        if not len(rows):
            return rows
        if not self._count:
            self._first, self._sums = rows[0].astype(np.float64), np.zeros((2, rows.shape[1]))
        shifted = rows - self._first  # so that squares are not the small difference of large ones
        total, square = (np.cumsum(np.concatenate([before[None], values]), axis=0)[1:]
                         for before, values in zip(self._sums, (shifted, shifted**2), strict=True))
        count = (self._count + 1 + np.arange(len(rows)))[:, None]
        mean = total / count
        variance = np.maximum(square - count * mean**2, 0) + self.weight * self.spread**2
        self._count, self._sums = self._count + len(rows), np.stack([total[-1], square[-1]])
        return ((shifted - mean) / np.sqrt(variance / (self.weight + count))).astype(rows.dtype)


def normalised(rows: np.ndarray, how: str, spread: float, rate: float, talker: Callable[[], Moments]) -> np.ndarray:
    """Rows (n, C) of a recording, normalised.

    Args:
        rows: of one recording, in order.
        how: one of :data:`HOW`.
        spread: the usual deviation of a column.
        rate: rows a second.
        talker: gives the moments of the talker's recordings.
    """
    if how == "running":
        return Running(spread, rate).push(rows)
    if how == "none" or not len(rows):
        return rows
    return (talker() if how == "talker" else Moments.of([rows], spread))(rows)


_KNOWN: dict[object, tuple[object, Moments]] = {}
_REMEMBERED = 16


def talker_moments(sound: Sound, rows_of: Callable[[Sound], np.ndarray], key: object, spread: float) -> Moments:
    """The moments of a talker's recordings, 100 at most; of the recording alone where no others are known.

    Args:
        sound: one of them.
        rows_of: gives the rows (n, C) of a recording.
        key: of what the rows depend on, by which the moments are remembered.
        spread: the usual deviation of a column.
    """
    if sound.others is None:
        return Moments.of([rows_of(sound)], spread)
    where = (id(sound.others), key)
    if where not in _KNOWN or _KNOWN[where][0] is not sound.others:
        if len(_KNOWN) >= _REMEMBERED:
            _KNOWN.clear()
        made = Moments.of((rows_of(other) for other in islice(sound.others(), _RECORDINGS)), spread)
        _KNOWN[where] = (sound.others, made)
    return _KNOWN[where][1]
