"""Weights of a head's shapes that put its points where they are wanted: bounded least squares, smooth over time.

``min sum_t |A w_t - b_t|^2 + r |w_t|^2 + s |w_t - w_{t-1}|^2`` with ``0 <= w <= 1``. All frames are solved at once by
alternating directions (S. Boyd et al., "Distributed optimization and statistical learning via the alternating direction
method of multipliers", 2011, section 5): in the eigenvectors of ``A'A`` and the cosine transform over time the
quadratic step is a division.
"""

from dataclasses import dataclass

import numpy as np
from scipy.fft import dct, idct

_STEPS, _CLOSE = 3000, 1e-5
SEEN = 0.02
"""Share of the largest movement of any shape that a shape must move the points by, to be told at all."""
TOLD = 0.8
"""Share of a weight that comes back where points alone tell it; below it the shape is ambiguous."""


@dataclass(frozen=True)
class FitSettings:
    """How weights are found.

    Args:
        ridge: what a weight costs, over the mean square that a shape moves the points by.
        smooth: what a change from one frame to the next costs, in the same unit.
    """

    ridge: float = 1e-3
    smooth: float = 2e-3


def fit_weights(basis: np.ndarray, wanted: np.ndarray, settings: FitSettings | None = None) -> np.ndarray:
    """Weights (F, S) between 0 and 1.

    Args:
        basis: how shapes move the points (S, N), flat.
        wanted: how the points are to have moved (F, N).
        settings: of the costs.
    """
    settings = settings or FitSettings()
    form = basis @ basis.T
    unit = float(np.trace(form)) / max(len(form), 1) or 1.0
    values, vectors = np.linalg.eigh(form / unit)
    right = (wanted @ basis.T) / unit
    frames = len(wanted)
    slow = 2 - 2 * np.cos(np.pi * np.arange(frames) / max(frames, 1))
    penalty = float(np.sqrt(max(values[-1], 1e-9) * max(settings.ridge, 1e-4)))
    divisor = values + settings.ridge + settings.smooth * slow[:, None] + penalty
    weights, dual = np.zeros_like(right), np.zeros_like(right)
    for _ in range(_STEPS):
        asked = dct(right + penalty * (weights - dual), axis=0, norm="ortho") @ vectors
        free = idct((asked / divisor) @ vectors.T, axis=0, norm="ortho")
        before, weights = weights, np.clip(free + dual, 0, 1)
        dual += free - weights
        if max(np.abs(free - weights).max(initial=0), np.abs(weights - before).max(initial=0)) < _CLOSE:
            break
    return weights


@dataclass(frozen=True)
class Told:
    """Which shapes points tell apart.

    Args:
        share: of each weight (S,) that would come back; 0 where the shape moves no point.
        clear: shapes whose weights the points tell (S,) bool.
        seen: shapes that move the points at all (S,) bool.
    """

    share: np.ndarray
    clear: np.ndarray
    seen: np.ndarray


def what_is_told(basis: np.ndarray, settings: FitSettings | None = None) -> Told:
    """Which weights come back from points: the diagonal of the resolution ``(A'A + r)^-1 A'A``.

    Args:
        basis: how shapes move the points (S, N).
        settings: of the costs.
    """
    settings = settings or FitSettings()
    form = basis @ basis.T
    unit = float(np.trace(form)) / max(len(form), 1) or 1.0
    size = np.sqrt(np.diag(form))
    seen = size > SEEN * size.max(initial=0)
    share = np.diag(np.linalg.solve(form / unit + settings.ridge * np.eye(len(form)), form / unit))
    return Told(np.where(seen, share, 0.0), seen & (share >= TOLD), seen)
