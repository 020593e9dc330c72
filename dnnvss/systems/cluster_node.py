"""A part of a face whose appearance is clustered, each cluster a linear model of sound and appearance together.

**Source**: Cosker et al. 2004, sections 4.2 to 4.4.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from dnnvss.systems.cluster_choice import posteriors, transitions, viterbi
from dnnvss.systems.mapping import cluster, nearest

CHOICES = ("nearest", "viterbi", "posterior")
ESTIMATES = ("projection", "regression")
_BOUND = 3.0
"""Standard deviations that the parameters of a cluster keep within."""
_SHARE = 0.95
"""Of a cluster's variance that its eigenvectors explain."""


@dataclass(frozen=True)
class ClusteredNode:
    """K clusters of appearance c (m) with the sound s (p) of their frames.

    In cluster i ``W c = c_i + Rc d`` and ``s = s_i + Rs d``, where the columns of ``[Rc; Rs]`` are the eigenvectors of
    its joint vectors ``[W c; s]`` and ``d`` is within three standard deviations of each.

    Args:
        appearance: mean appearance (K, m) of each cluster.
        sound: mean sound (K, p).
        appearance_modes: ``Rc / W``, (K, q, m); rows of zero where a cluster has fewer than q.
        estimates: (K, q, p), what d is for a sound less its cluster's mean.
        limits: (K, q), three standard deviations of d.
        spread: (p,), standard deviation of the sound over all frames, of distances to clusters.
        within: (p,), the same within clusters, of probabilities.
        start, steps: log probabilities of clusters (K,) and of steps between them (K, K).
    """

    appearance: np.ndarray
    sound: np.ndarray
    appearance_modes: np.ndarray
    estimates: np.ndarray
    limits: np.ndarray
    spread: np.ndarray
    within: np.ndarray
    start: np.ndarray
    steps: np.ndarray

    def shares(self, sound: np.ndarray, choice: str, weight: float) -> np.ndarray:
        """How much each cluster counts in each frame, (T, K), for sound (T, p).

        Args:
            sound: of the frames.
            choice: ``nearest`` is the cluster of the least Mahalanobis distance (equation 8); ``viterbi`` and
                ``posterior`` follow the steps between clusters that the training frames made.
            weight: of the sound's log probability against that of a step; frames that follow each other say much the
                same, so that it is below 1.
        """
        if choice == "nearest":
            return np.eye(len(self.sound))[nearest(sound / self.spread, self.sound / self.spread)]
        gaps = (((sound / self.within) ** 2).sum(axis=1)[:, None] + ((self.sound / self.within) ** 2).sum(axis=1)
                - 2 * (sound / self.within) @ (self.sound / self.within).T)
        scores = -0.5 * weight * gaps
        if choice == "viterbi":
            return np.eye(len(self.sound))[viterbi(scores, self.start, self.steps)]
        return posteriors(scores, self.start, self.steps)

    def __call__(self, sound: np.ndarray, choice: str, weight: float) -> np.ndarray:
        """The appearance (T, m) for sound (T, p)."""
        shares = self.shares(sound, choice, weight)
        out = np.zeros((len(sound), self.appearance.shape[1]))
        for k in np.flatnonzero(shares.max(axis=0) > 1e-4):
            own = shares[:, k] > 1e-4
            d = np.clip((sound[own] - self.sound[k]) @ self.estimates[k].T, -self.limits[k], self.limits[k])
            out[own] += shares[own, k, None] * (self.appearance[k] + d @ self.appearance_modes[k])
        return out

    def state(self) -> dict[str, np.ndarray]:
        """The arrays by name."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @classmethod
    def from_state(cls, state: dict[str, np.ndarray]) -> "ClusteredNode":
        """The node of :meth:`state`."""
        return cls(**state)


def fit_node(appearance: Sequence[np.ndarray], sound: Sequence[np.ndarray], clusters: int, starts: int,
             estimate: str = "projection", seed: int = 0) -> ClusteredNode:
    """Cluster the appearance (n, m) of utterances by k-means and model each cluster with its sound (n, p).

    W is the root of the sound's variance over that of appearance, one number, so that both count alike.

    Args:
        appearance, sound: of each utterance, frame by frame; both with mean zero over all frames.
        clusters, starts: of k-means; the start with the least error is kept.
        estimate: ``projection`` takes ``d = Rs' (s - s_i)`` as the paper does (equation 11); ``regression`` the d that
            is expected of a Gaussian cluster, which heeds how little of d the sound tells.
        seed: of the starts.
    """
    seen, heard = np.concatenate(appearance), np.concatenate(sound)
    scale = float(np.sqrt(heard.var(axis=0).sum() / max(seen.var(axis=0).sum(), 1e-30)))
    centres = cluster(seen, clusters, starts, seed)
    owner = nearest(seen, centres)
    known, owner = np.unique(owner, return_inverse=True)
    paths = np.split(owner, np.cumsum([len(a) for a in appearance])[:-1])
    models = [_Cluster.of(scale * seen[owner == k], heard[owner == k], estimate) for k in range(len(known))]
    most = max(len(m.limits) for m in models)
    means = np.stack([m.sound for m in models])
    start, steps = transitions(paths, len(known))
    spread = np.maximum(heard.std(axis=0), 1e-9)
    within = np.maximum(np.sqrt(((heard - means[owner]) ** 2).mean(axis=0)), 1e-3 * spread)
    return ClusteredNode(np.stack([m.appearance for m in models]) / scale, means,
                         np.stack([_padded(m.modes, most) for m in models]) / scale,
                         np.stack([_padded(m.estimate, most) for m in models]),
                         np.stack([_padded(m.limits, most) for m in models]), spread, within, start, steps)


@dataclass(frozen=True)
class _Cluster:
    """A linear model of one cluster, with appearance in units of the sound."""

    appearance: np.ndarray
    sound: np.ndarray
    modes: np.ndarray
    estimate: np.ndarray
    limits: np.ndarray

    @classmethod
    def of(cls, seen: np.ndarray, heard: np.ndarray, estimate: str) -> "_Cluster":
        centre, width = np.hstack([seen, heard]).mean(axis=0), seen.shape[1]
        rows = np.hstack([seen, heard]) - centre
        values, vectors = np.linalg.eigh(rows.T @ rows / len(rows))
        values, vectors = np.maximum(values[::-1], 0), vectors[:, ::-1]
        kept = max(1, int(np.searchsorted(np.cumsum(values), _SHARE * values.sum())) + 1)
        values, modes = values[:kept], vectors[:, :kept].T
        told = modes[:, width:]
        if estimate == "regression":
            left = max(float(rows[:, width:].var(axis=0).sum() - ((told**2).sum(axis=1) * values).sum()), 0)
            noise = left / heard.shape[1] + 1e-6 * max(values[0], 1e-12)
            of_sound = (told.T * values) @ told + noise * np.eye(heard.shape[1])
            told = np.linalg.solve(of_sound, told.T * values).T
        return cls(centre[:width], centre[width:], modes[:, :width], told, _BOUND * np.sqrt(values))


def _padded(rows: np.ndarray, count: int) -> np.ndarray:
    """An array with rows of zero behind its own, ``count`` in all."""
    return np.pad(rows, [(0, count - len(rows))] + [(0, 0)] * (rows.ndim - 1))
