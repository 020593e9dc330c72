"""What is usual of the markers of a session: how they move together, which tells one from the others."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

_MODES = 24
"""Components of the common movement."""
_FRAMES = 4000
_ROUNDS = 3
_CHUNK = 256
_FLOOR = 0.01
"""Variance of a coordinate that its neighbours cannot tell at least, mm^2."""


@dataclass(frozen=True)
class Usual:
    """Probabilistic principal components of the coordinates of all markers.

    Args:
        mean: (C,) of the 3 M coordinates, mm.
        modes: (K, C), each times its standard deviation.
        own: variance (C,) of what the modes leave of each coordinate.
    """

    mean: np.ndarray
    modes: np.ndarray
    own: np.ndarray

    def told(self, rows: np.ndarray, known: np.ndarray) -> np.ndarray:
        """What the known coordinates of each frame tell of all (F, C): the mean of the posterior.

        Args:
            rows: (F, C); what is not known may be NaN.
            known: (F, C) bool.

        **Source**: Tipping and Bishop, "Probabilistic principal component analysis", 1999, equation 6, with a noise of
        its own for each coordinate.
        """
        parts = range(0, len(rows), _CHUNK)
        return np.concatenate(
            [self._told(rows[k : k + _CHUNK], known[k : k + _CHUNK]) for k in parts]
        )

    def _told(self, rows: np.ndarray, known: np.ndarray) -> np.ndarray:
        weights = known / self.own
        information = (self.modes * weights[:, None]) @ self.modes.T + np.eye(len(self.modes))
        right = np.where(known, (rows - self.mean) * weights, 0.0) @ self.modes.T
        found = np.linalg.solve(information, right[..., None])[..., 0]
        return np.asarray(self.mean + found @ self.modes)


def learn_usual(takes: Sequence[np.ndarray]) -> Usual:
    """What is usual of takes (F, C) with NaN where a coordinate is missing.

    Missing coordinates are what the components of the round before tell of them.

    **Source**: Schneider, "Analysis of incomplete climate data", Journal of Climate 14, 2001: regularised EM.
    """
    rows = np.concatenate(list(takes))
    rows = rows[:: max(1, -(-len(rows) // _FRAMES))]
    known = np.isfinite(rows)
    mean = np.nanmean(np.where(known.any(axis=0), rows, 0.0), axis=0)
    full = np.where(known, rows, mean)
    usual = _components(full)
    for _ in range(_ROUNDS):
        full = np.where(known, rows, usual.told(rows, known))
        usual = _components(full)
    return usual


def _components(full: np.ndarray) -> Usual:
    mean = full.mean(axis=0)
    _, values, modes = np.linalg.svd(full - mean, full_matrices=False)
    count = min(_MODES, len(values))
    scaled = modes[:count] * (values[:count, None] / np.sqrt(len(full)))
    left = ((full - mean) ** 2).mean(axis=0) - (scaled**2).sum(axis=0)
    return Usual(mean, scaled, np.maximum(left, _FLOOR))
