"""One scale for more than two systems from judgements of pairs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import connected_components

from dnnvss.errors import DnnvssError
from dnnvss.evaluation.viewing.shares import Share, t_interval


@dataclass(frozen=True)
class BradleyTerry:
    """Strengths of systems on a logarithmic scale whose mean is 0.

    A system wins against another with probability 1 / (1 + exp(other - own)).

    Args:
        strengths: (K,).
        low, high: (K,) 95 % intervals; NaN of a single viewer.
        covariance: (K, K) of the strengths, robust to judgements of one viewer that hang together.
        viewers: who judged.
    """

    strengths: np.ndarray
    low: np.ndarray
    high: np.ndarray
    covariance: np.ndarray
    viewers: int

    def difference(self, first: int, second: int) -> Share:
        """Strength of the first less that of the second, its 95 % interval, and the two-sided p of none."""
        value = float(self.strengths[first] - self.strengths[second])
        c = self.covariance
        error = float(np.sqrt(max(c[first, first] + c[second, second] - 2 * c[first, second], 0.0)))
        return t_interval(value, error, self.viewers - 1)


def fit_bradley_terry(count: int, pairs: np.ndarray, won: np.ndarray, viewer: Sequence[int] | np.ndarray
                      ) -> BradleyTerry:
    """The most likely strengths, with intervals that treat all judgements of a viewer as one observation.

    Args:
        count: K, systems.
        pairs: (N, 2) numbers of the systems that were judged.
        won: (N,) 1 where the first was preferred, 0 where the second was, 0.5 for a tie.
        viewer: (N,) who judged.

    Raises:
        DnnvssError: a system or a group of them never lost, or never won, against the rest: no finite strength fits.

    **Source**: Bradley and Terry (1952); the steps of Hunter (2004), equation 3, and the condition of Ford (1957); the
    covariance of Liang and Zeger (1986) times V / (V - 1).
    """
    wins = np.zeros((count, count))
    np.add.at(wins, (pairs[:, 0], pairs[:, 1]), won)
    np.add.at(wins, (pairs[:, 1], pairs[:, 0]), 1 - np.asarray(won))
    if connected_components(wins > 0, connection="strong")[0] > 1:
        raise DnnvssError("a system never lost, or never won, against the rest: no finite strength fits",
                          remedy="Ask more viewers, or leave that system out")
    strengths = _most_likely(wins)
    covariance, viewers = _robust(strengths, wins, pairs, np.asarray(won, dtype=float), np.asarray(viewer))
    errors = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    found = [t_interval(float(s), float(e), viewers - 1) for s, e in zip(strengths, errors, strict=True)]
    low, high = (np.array([getattr(share, end) for share in found]) for end in ("low", "high"))
    return BradleyTerry(strengths, low, high, covariance, viewers)


def _most_likely(wins: np.ndarray) -> np.ndarray:
    """Strengths (K,) of the greatest likelihood."""
    games, total = wins + wins.T, wins.sum(axis=1)
    power = np.ones(len(wins))
    for _ in range(20_000):
        new = total / (games / (power[:, None] + power[None])).sum(axis=1)
        new /= np.exp(np.log(new).mean())
        if np.abs(np.log(new / power)).max() < 1e-10:
            break
        power = new
    return np.log(new)


def _robust(strengths: np.ndarray, wins: np.ndarray, pairs: np.ndarray, won: np.ndarray, viewer: np.ndarray
            ) -> tuple[np.ndarray, int]:
    """The sandwich (K, K) of the information and of viewers' gradients, and the number of viewers."""
    chance = 1 / (1 + np.exp(strengths[None] - strengths[:, None]))
    weight = (wins + wins.T) * chance * chance.T
    bread = np.linalg.pinv(np.diag(weight.sum(axis=1)) - weight)
    names, row = np.unique(viewer, return_inverse=True)
    gradient = np.zeros((len(names), len(strengths)))
    off = won - chance[pairs[:, 0], pairs[:, 1]]
    np.add.at(gradient, (row, pairs[:, 0]), off)
    np.add.at(gradient, (row, pairs[:, 1]), -off)
    v = len(names)
    return bread @ (gradient.T @ gradient) @ bread * (v / max(v - 1, 1)), v
