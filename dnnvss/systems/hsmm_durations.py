"""How long each state lasts inside a phone whose length is given: one search for alignment and for synthesis."""

import numpy as np

STATES = 5
"""States of a phone, passed from left to right."""


def equal_states(frames: np.ndarray) -> np.ndarray:
    """Return durations (S, 5) of states that share phones of ``frames`` (S,) equally; in short phones some are 0."""
    edges = np.arange(STATES + 1) * np.asarray(frames)[:, None] / STATES
    return np.diff(np.floor(edges + 0.5).astype(np.int64), axis=1)


def least_duration(frames: int) -> int:
    """Return the least duration of a state: one frame, or none in a phone with fewer frames than states."""
    return 1 if frames >= STATES else 0


def best_durations(frames: int, mean: np.ndarray, variance: np.ndarray,
                   likelihood: np.ndarray | None = None) -> np.ndarray:
    """Return the most probable state durations (G, 5) of G phones of the same length, exactly, in whole frames.

    Maximises the log densities of the durations under Gaussians, and of the frames where there are any, over all
    durations that sum to ``frames``. Without frames and without rounding this is ``m + rho v`` with
    ``rho = (frames - sum m) / sum v`` (**Source**: Yoshimura et al. 1998, equations 5 and 6).

    Args:
        frames: length of the phones.
        mean, variance: of the durations (G, 5) in frames.
        likelihood: log density of each frame in each state (G, frames, 5), or None.
    """
    group, least = len(mean), least_duration(frames)
    lengths = np.arange(frames + 1)
    prior = -0.5 * (lengths - mean[..., None]) ** 2 / variance[..., None]
    emitted = np.zeros((group, frames + 1, STATES))
    if likelihood is not None:
        emitted[:, 1:] = np.cumsum(likelihood, axis=1, dtype=np.float64)
    score = np.full((group, frames + 1), -np.inf)
    score[:, 0] = 0
    chosen = np.zeros((STATES, group, frames + 1), dtype=np.int32)
    for state in range(STATES):
        before, score = score - emitted[..., state], np.full_like(score, -np.inf)
        for length in range(least, frames + 1 - least * (STATES - 1)):
            candidate = before[:, : frames + 1 - length] + prior[:, state, length, None]
            better = candidate > score[:, length:]
            np.copyto(score[:, length:], candidate, where=better)
            np.copyto(chosen[state, :, length:], length, where=better)
        score += emitted[..., state]
    return _traced(chosen, frames)


def _traced(chosen: np.ndarray, frames: int) -> np.ndarray:
    group = chosen.shape[1]
    durations, end, rows = np.zeros((group, STATES), dtype=np.int64), np.full(group, frames), np.arange(group)
    for state in reversed(range(STATES)):
        durations[:, state] = chosen[state, rows, end]
        end = end - durations[:, state]
    return durations
