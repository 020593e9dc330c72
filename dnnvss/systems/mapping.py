"""A mapping from what is heard to what is seen: one matrix product a frame, or one of several by what is heard."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from dnnvss.systems.canonical import Moments, canonical, regression

Pairs = Sequence[tuple[np.ndarray, np.ndarray]]
"""Rows x (n, r) and y (n, s) of each utterance."""
_FACTORS = 5
"""Canonical factors in which the sound is divided into regions."""
_MOST = 20000
"""Frames that regions are found in."""


@dataclass(frozen=True)
class AudioVisual:
    """``y = matrix x + constant``, with a matrix for each region of the sound.

    Args:
        projection: (r, F), the canonical factors in which regions lie; the nearest centre is the region.
        centres: (R, F).
        matrices: (R, s, r).
        constants: (R, s).
    """

    projection: np.ndarray
    centres: np.ndarray
    matrices: np.ndarray
    constants: np.ndarray

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """The prediction (T, s) for rows (T, r)."""
        if len(self.matrices) == 1:
            return x @ self.matrices[0].T + self.constants[0]
        region, out = self.regions(x), np.empty((len(x), self.constants.shape[1]))
        for k in np.unique(region):
            out[region == k] = x[region == k] @ self.matrices[k].T + self.constants[k]
        return out

    def regions(self, x: np.ndarray) -> np.ndarray:
        """The region (T,) of each row (T, r)."""
        return nearest(x @ self.projection, self.centres)

    def state(self) -> dict[str, np.ndarray]:
        """The arrays by name."""
        return asdict(self)

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> "AudioVisual":
        """The mapping of :meth:`state`."""
        return cls(**state)


def fit_mapping(pairs: Pairs, groups: Sequence[Sequence[int]], regions: int = 1, factors: int | None = None,
                ridge: float = 0.0, starts: int = 4) -> AudioVisual:
    """The canonical-correlation regression of y on x.

    Args:
        pairs: to learn from.
        groups: columns of y that are regressed together; each column in one of them.
        regions: clusters of the sound, each with a regression of its own. They are found by k-means on the first
            canonical factors of all frames.
        factors, ridge: see :func:`~dnnvss.systems.canonical.regression`.
        starts: of k-means.

    **Source**: Theobald and Wilkinson 2007, sections 3.2 and 6 (regions: "more than one mapping could be defined, and
    the mapping used ... determined by the values of the auditory features").
    """
    width = pairs[0][0].shape[1]
    moments = Moments.of(np.hstack(pair) for pair in pairs)
    if regions == 1:
        matrix, constant = _regressed(moments, width, groups, factors, ridge)
        return AudioVisual(np.zeros((width, 0)), np.zeros((1, 0)), matrix[None], constant[None])
    projection = canonical(moments.covariance, width, ridge).x[:, :_FACTORS]
    centres = cluster(np.concatenate([x @ projection for x, _ in pairs]), regions, starts)
    found = [_regressed(Moments.of(_within(pairs, projection, centres, k)), width, groups, factors, ridge)
             for k in range(len(centres))]
    return AudioVisual(projection, centres, np.stack([m for m, _ in found]), np.stack([c for _, c in found]))


def cluster(rows: np.ndarray, count: int, starts: int, seed: int = 0) -> np.ndarray:
    """The centres (K, C) of ``count`` clusters of rows (n, C), fewer where there are fewer rows: best of many starts.

    The sum of squared distances decides between starts; at most 20,000 rows, evenly spread, are looked at.
    """
    from sklearn.cluster import KMeans  # slow to import, and synthesis needs none of it

    kept = rows[np.unique(np.linspace(0, len(rows) - 1, min(_MOST, len(rows))).astype(int))].astype(np.float64)
    count = min(count, len(np.unique(kept, axis=0)))
    return KMeans(count, n_init=starts, random_state=seed).fit(kept).cluster_centers_


def nearest(rows: np.ndarray, centres: np.ndarray) -> np.ndarray:
    """The nearest of centres (K, C) for each row (n, C), as (n,)."""
    return ((centres**2).sum(axis=1) - 2 * rows @ centres.T).argmin(axis=1)


def _within(pairs: Pairs, projection: np.ndarray, centres: np.ndarray, region: int) -> Iterator[np.ndarray]:
    for x, y in pairs:
        own = nearest(x @ projection, centres) == region
        yield np.hstack([x[own], y[own]])


def _regressed(moments: Moments, width: int, groups: Sequence[Sequence[int]], factors: int | None,
               ridge: float) -> tuple[np.ndarray, np.ndarray]:
    """The matrix (s, r) and the constant (s,)."""
    seen = moments.mean[width:]
    matrix, heard = np.zeros((len(seen), width)), np.arange(width)
    for group in groups:
        columns = np.concatenate([heard, width + np.asarray(group)])
        matrix[list(group)] = regression(moments.covariance[np.ix_(columns, columns)], width, factors, ridge)
    return matrix, seen - matrix @ moments.mean[:width]
