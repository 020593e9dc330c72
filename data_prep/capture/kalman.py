"""Kalman smoothing, forward and backward, of coordinates over time.

**Source**: Rauch, Tung and Striebel, "Maximum likelihood estimates of linear dynamic systems", AIAA Journal 3(8), 1965.
"""

import numpy as np

from dnnvss.robust import TO_SIGMA

_LEAST = 1e-3
"""Millimetres of noise that a coordinate is taken to have at least."""
_JERKS = np.logspace(2, 11, 19)
"""Spectral densities of the jerk that are tried, in variances of the noise per second^5."""
_QUICKER = 3
"""Steps above the likeliest density: speech mostly stands still, and its quickest moments must not be lost."""
_FEW = 8
"""Frames below which nothing is smoothed."""


def noise_of(tracks: np.ndarray) -> np.ndarray:
    """The standard deviation (C,) of the white noise of tracks (F, C), from their third differences.

    Movement of speech at 100 frames a second has next to none; white noise of variance s has 20 s.
    """
    return np.maximum(
        TO_SIGMA * np.median(np.abs(np.diff(tracks, n=3, axis=0)), axis=0) / np.sqrt(20), _LEAST
    )


def smoothed(tracks: np.ndarray, rate: float) -> np.ndarray:
    """Tracks (F, C) without their white noise.

    Each coordinate moves with a jerk that is white noise, whose density is 32 times the likeliest; what is measured is
    its place and noise (:func:`noise_of`).

    Args:
        tracks: finite.
        rate: frames a second.
    """
    if len(tracks) < _FEW:
        return tracks.copy()
    noise = noise_of(tracks)
    scaled = (tracks - tracks[0]) / noise
    likely = np.stack([_filtered(scaled, rate, jerk)[3] for jerk in _JERKS])
    best = np.minimum(likely.argmax(axis=0) + _QUICKER, len(_JERKS) - 1)
    out = np.empty_like(scaled)
    for k in np.unique(best):
        own = best == k
        out[:, own] = _backward(scaled[:, own], rate, _JERKS[k])
    return out * noise + tracks[0]


def _model(rate: float, jerk: float) -> tuple[np.ndarray, np.ndarray]:
    """Transition (3, 3) of place, speed and acceleration over a frame, and what the jerk adds to their covariance."""
    t = 1 / rate
    step = np.array([[1, t, t**2 / 2], [0, 1, t], [0, 0, 1]])
    added = jerk * np.array(
        [[t**5 / 20, t**4 / 8, t**3 / 6], [t**4 / 8, t**3 / 3, t**2 / 2], [t**3 / 6, t**2 / 2, t]]
    )
    return step, added


def _filtered(
    scaled: np.ndarray, rate: float, jerk: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """States (F, 3, C) and covariances (F, 3, 3) after each frame, those before it, and log likelihoods (C,)."""
    step, added = _model(rate, jerk)
    frames, columns = scaled.shape
    states, covariances, before = (
        np.empty((frames, 3, columns)),
        np.empty((frames, 3, 3)),
        np.empty((frames, 3, 3)),
    )
    state, covariance = np.zeros((3, columns)), np.diag([1.0, 1e6, 1e9])
    likely = np.zeros(columns)
    for f in range(frames):
        if f:
            state, covariance = step @ state, step @ covariance @ step.T + added
        before[f] = covariance
        spread = covariance[0, 0] + 1
        surprise = scaled[f] - state[0]
        gain = covariance[:, 0] / spread
        state = state + gain[:, None] * surprise
        covariance = covariance - np.outer(gain, covariance[0])
        states[f], covariances[f] = state, covariance
        if f >= 3:
            likely -= 0.5 * (surprise**2 / spread + np.log(spread))
    return states, covariances, before, likely


def _backward(scaled: np.ndarray, rate: float, jerk: float) -> np.ndarray:
    """The smoothed places (F, C)."""
    step, _ = _model(rate, jerk)
    states, covariances, before, _ = _filtered(scaled, rate, jerk)
    out = np.empty_like(scaled)
    state = states[-1]
    out[-1] = state[0]
    for f in range(len(scaled) - 2, -1, -1):
        gain = np.linalg.solve(before[f + 1], step @ covariances[f]).T
        state = states[f] + gain @ (state - step @ states[f])
        out[f] = state[0]
    return out
