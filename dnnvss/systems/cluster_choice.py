"""Which cluster each frame belongs to: the nearest by its sound, or a chain of clusters by a hidden Markov model."""

from collections.abc import Sequence

import numpy as np

_UNSEEN = 0.1
"""Added to each count of a step from one cluster to another."""


def transitions(paths: Sequence[np.ndarray], clusters: int) -> tuple[np.ndarray, np.ndarray]:
    """Logarithms of the probability of each cluster (K,) and of each step between two (K, K), from paths (T,)."""
    counts, steps = np.full(clusters, _UNSEEN), np.full((clusters, clusters), _UNSEEN)
    for path in paths:
        np.add.at(counts, path, 1)
        np.add.at(steps, (path[:-1], path[1:]), 1)
    return np.log(counts / counts.sum()), np.log(steps / steps.sum(axis=1, keepdims=True))


def viterbi(scores: np.ndarray, start: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """The most probable path (T,) of log scores (T, K), of the first cluster (K,) and of steps (K, K)."""
    total, back = start + scores[0], np.zeros(scores.shape, dtype=np.int64)
    for t in range(1, len(scores)):
        reached = total[:, None] + steps
        back[t] = reached.argmax(axis=0)
        total = reached.max(axis=0) + scores[t]
    path = np.full(len(scores), total.argmax())
    for t in range(len(scores) - 1, 0, -1):
        path[t - 1] = back[t, path[t]]
    return path


def posteriors(scores: np.ndarray, start: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """The probability (T, K) of each cluster in each frame, given all frames; arguments as for :func:`viterbi`."""
    likelihood = np.exp(scores - scores.max(axis=1, keepdims=True))
    step = np.exp(steps)
    ahead, behind = np.empty_like(likelihood), np.ones_like(likelihood)
    ahead[0] = _shared(np.exp(start) * likelihood[0])
    for t in range(1, len(scores)):
        ahead[t] = _shared((ahead[t - 1] @ step) * likelihood[t])
    for t in range(len(scores) - 2, -1, -1):
        behind[t] = _shared(step @ (likelihood[t + 1] * behind[t + 1]))
    joint = ahead * behind
    return joint / joint.sum(axis=1, keepdims=True)


def _shared(values: np.ndarray) -> np.ndarray:
    """Values (K,) that sum to 1, none of them 0, so that frames far from all clusters can be divided by."""
    kept = values + 1e-300
    return kept / kept.sum()
