"""Recorded fragments brought to the times of a sentence, and blended where they overlap."""

from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np


def _cosine(u: np.ndarray) -> np.ndarray:
    return np.asarray(0.5 * (1 + np.cos(np.pi * u)))


WEIGHTINGS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "cosine": _cosine,
    "linear": lambda u: 1 - u,
    "early": lambda u: _cosine(np.sqrt(u)),
    "late": lambda u: _cosine(u**2),
}
"""Name of a weighting function to g(u), which falls from 1 to 0 as u rises from 0 to 1 (figure 3 of the paper)."""


def warped(times: np.ndarray, source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Times (n,) of a recording in a sentence whose phones lie elsewhere.

    Args:
        times: of its frames; beyond the first and the last edge time goes on as it was recorded.
        source, target: (P + 1,) edges of the phones in the recording and in the sentence.
    """
    inner = np.interp(times, source, target)
    return np.where(
        times < source[0],
        target[0] + times - source[0],
        np.where(times > source[-1], target[-1] + times - source[-1], inner),
    )


def resampled(values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """The interpolant through the frames (n, D) of a recording, at places (T,) between them, (T, D).

    ``f(x) = p(x) + sum_i a_i / sqrt(1 + ((x - i) / w)^2)`` with a straight line ``p``, through every frame; the width
    ``w`` is :data:`WIDTH` frames. Frames are evenly spread in the recording, and where each wanted moment lies among
    them the warp tells: the same curve as through frames that were warped first, without the equations becoming
    singular where phones are squeezed.

    **Source**: Edge et al. 2004, section 5.1.2, equation 1, with inverse multiquadrics.
    """
    if len(values) < 3:
        return np.stack(
            [np.interp(at, np.arange(len(values)), column) for column in values.T], axis=1
        )
    return np.asarray(_basis(at, len(values)) @ (_inverse(len(values)) @ values))


WIDTH = 1.5


def _basis(at: np.ndarray, count: int) -> np.ndarray:
    """The basis functions and the terms of the line (T, n + 2) at places (T,)."""
    radial = 1 / np.sqrt(1 + ((at[:, None] - np.arange(count)) / WIDTH) ** 2)
    return np.concatenate([radial, np.ones((len(at), 1)), at[:, None] / count], axis=1)


@lru_cache(maxsize=128)
def _inverse(count: int) -> np.ndarray:
    """What makes weights (n + 2, D) of n samples, the line orthogonal to the radial part: (n + 2, n)."""
    system = np.zeros((count + 2, count + 2))
    system[:count] = _basis(np.arange(count, dtype=float), count)
    system[count:, :count] = system[:count, count:].T
    return np.asarray(np.linalg.inv(system)[:, :count])


def overlaps(edges: np.ndarray, joints: np.ndarray, share: float) -> np.ndarray:
    """Half the length (J,) of the overlap at each joint: a share of the shortest of its phone and the two beside it.

    Args:
        edges: (S + 1,) of the phones of the sentence.
        joints: (J,) the phones in whose middle pieces meet.
        share: of the length, below 1.

    **Source**: Edge et al. 2004, section 5.1.3: always a fraction of the smallest phone-to-phone interval.
    """
    lengths = np.diff(edges)
    near = np.stack([lengths[np.clip(joints + k, 0, len(lengths) - 1)] for k in (-1, 0, 1)])
    return np.asarray(0.5 * share * near.min(axis=0)) if len(joints) else np.zeros(0)


def blended(
    pieces: Sequence[tuple[int, np.ndarray]],
    places: np.ndarray,
    halves: np.ndarray,
    frames: int,
    weighting: str,
) -> np.ndarray:
    """Pieces (T, D), one after the other, each faded into the next where they overlap.

    ``x(t) = g(u) x_0(t) + (1 - g(u)) x_1(t)``, ``u = (t - t_0) / (t_1 - t_0)``.

    Args:
        pieces: first frame and values (n, D) of each; they cover their overlaps.
        places: (pieces - 1,) where they meet, in frames; frame k stands at k + 1/2.
        halves: (pieces - 1,) half the length of each overlap, in frames.
        frames: T.
        weighting: of :data:`WEIGHTINGS`.

    **Source**: Edge et al. 2004, equation 2.
    """
    fade = WEIGHTINGS[weighting]
    out = np.zeros((frames, pieces[0][1].shape[1]))
    for k, (start, values) in enumerate(pieces):
        time = np.arange(start, start + len(values)) + 0.5
        weight = np.ones(len(values))
        if k:
            weight *= 1 - fade(_progress(time, places[k - 1], halves[k - 1]))
        if k < len(pieces) - 1:
            weight *= fade(_progress(time, places[k], halves[k]))
        out[start : start + len(values)] += weight[:, None] * values
    return out


def _progress(time: np.ndarray, place: float, half: float) -> np.ndarray:
    if half <= 0:
        return (time > place).astype(float)
    return np.asarray(np.clip((time - place + half) / (2 * half), 0, 1))
