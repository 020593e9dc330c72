"""Weights of a head's shapes that put its points where they are wanted: bounded least squares, smooth over time.

``min sum_t |A w_t - b_t|^2 + r |w_t|^2 + p |left_t - right_t|^2 + s |w_t - w_{t-1}|^2`` with ``0 <= w <= 1``.

All frames are solved at once by alternating directions (S. Boyd et al., "Distributed optimization and
statistical learning via the alternating direction method of multipliers", 2011, section 5): in the
eigenvectors of ``A'A`` and the cosine transform over time the quadratic step is a division.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import dct, idct

_STEPS, _CLOSE = 3000, 1e-5
SEEN = 0.02
"""Share of the largest movement of any shape that a shape must move the points by, to be told at all."""
TOLD = 0.8
"""Share of a weight that comes back where points tell it; below it the shape is ambiguous."""
_DIRECTIONS = ("jawLeft", "mouthLeft")
"""Shapes whose name is a direction, not a side."""


@dataclass(frozen=True)
class FitSettings:
    """How weights are found.

    Args:
        ridge: what a weight costs, over the mean square that a shape moves the points by.
        smooth: what a change from one frame to the next costs, in the same unit.
        level: what a difference between a shape's left and right side costs.
    """

    ridge: float = 1e-3
    smooth: float = 1e-2
    level: float = 3e-2


def fit_weights(
    basis: np.ndarray,
    wanted: np.ndarray,
    names: Sequence[str] = (),
    settings: FitSettings | None = None,
) -> np.ndarray:
    """Weights (F, S) between 0 and 1.

    Args:
        basis: how shapes move the points (S, N), flat.
        wanted: how the points are to have moved (F, N).
        names: of the shapes, from which those are known that are two sides of one.
        settings: of the costs.
    """
    settings = settings or FitSettings()
    form = basis @ basis.T
    unit = float(np.trace(form)) / max(len(form), 1) or 1.0
    values, vectors = np.linalg.eigh(form / unit + settings.level * _sides(names, len(form)))
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
        if (
            max(np.abs(free - weights).max(initial=0), np.abs(weights - before).max(initial=0))
            < _CLOSE
        ):
            break
    return weights


def _sides(names: Sequence[str], size: int) -> np.ndarray:
    """The form (S, S) of the squares of left less right, over all shapes that have two sides."""
    form = np.zeros((size, size))
    for k, name in enumerate(names):
        other = name.removesuffix("Left") + "Right"
        if name.endswith("Left") and name not in _DIRECTIONS and other in names:
            i = list(names).index(other)
            form[[k, i], [k, i]] += 1
            form[[k, i], [i, k]] -= 1
    return form


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


def what_is_told(
    basis: np.ndarray, names: Sequence[str] = (), settings: FitSettings | None = None
) -> Told:
    """Which weights come back from points: the diagonal of the resolution ``(A'A + r + p)^-1 A'A``.

    Args:
        basis: how shapes move the points (S, N).
        names: of the shapes.
        settings: of the costs.
    """
    settings = settings or FitSettings()
    form = basis @ basis.T
    unit = float(np.trace(form)) / max(len(form), 1) or 1.0
    size = np.sqrt(np.diag(form))
    seen = size > SEEN * size.max(initial=0)
    held = settings.ridge * np.eye(len(form)) + settings.level * _sides(names, len(form))
    share = np.diag(np.linalg.solve(form / unit + held, form / unit))
    return Told(np.where(seen, share, 0.0), seen & (share >= TOLD), seen)
