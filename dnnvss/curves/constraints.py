"""Constraints in the solve of parameter generation: closures, contacts, keys and ranges that a trajectory must keep."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse

from dnnvss.curves.equations import NormalEquations, precision_of
from dnnvss.curves.multipliers import influences, multiply, solve_ranges
from dnnvss.curves.windows import STATIC_DELTA_DELTA2, Windows
from dnnvss.errors import DnnvssError

_ARRAYS = ("frames", "vectors", "low", "high", "softness", "streams")
_SWEEPS = 60
_TOLERANCE = 1e-10
"""Share of a constraint's own size to which it is met."""
_INFEASIBLE = 1e-6
"""A constraint that misses by more than this share of its size in the end contradicts the others."""


@dataclass(frozen=True)
class Constraints:
    """Linear functionals of single frames, each with the range that it must lie in.

    Constraint ``i`` says ``low[i] <= vectors[i] . y <= high[i]``, where ``y`` is the stream ``streams[i]`` (0 static,
    1 delta, ...) of frame ``frames[i]``, edges held. Equal bounds make an equality, an infinite bound is none.
    A ``softness`` of 0 holds the constraint; a positive one, in the functional's unit, lets it give way like an
    observation of that standard deviation.

    Args:
        frames: (M,) int.
        vectors: (M, D).
        low, high: (M,), in the functional's unit.
        softness: (M,), zero for hard.
        streams: (M,) int.
        labels: a word for each, used in messages.

    Raises:
        DnnvssError: sizes that differ, values that are NaN, a zero vector, or a range that is empty.
    """

    frames: np.ndarray
    vectors: np.ndarray
    low: np.ndarray
    high: np.ndarray
    softness: np.ndarray
    streams: np.ndarray
    labels: tuple[str, ...]

    def __post_init__(self) -> None:
        count = len(self.labels)
        sizes = {len(a) for a in (self.frames, self.vectors, self.low, self.high, self.softness, self.streams)}
        if sizes != {count}:
            raise DnnvssError(f"constraints have {sorted(sizes)} entries and {count} labels", remedy="Give one of each")
        soft = (self.softness >= 0) & (self.softness < np.inf)
        open_ = (self.low <= self.high) & (self.low < np.inf) & (self.high > -np.inf)
        known = np.isfinite(self.vectors).all(axis=-1)
        seen = self.vectors.any(axis=-1)
        if (soft & open_ & known & seen).all():
            return
        bounds = np.column_stack([self.low, self.high, self.softness])
        self._refuse(np.isnan(bounds).any(axis=1) | ~known,
                     "holds a value that is not a number", "Give finite vectors and bounds that are numbers")
        self._refuse(~open_, "asks for a range that is empty", "Give a lower bound that is not above the upper one")
        self._refuse(~soft, "has a softness that is negative or infinite",
                     "Give 0 to hold it, or a deviation in the functional's unit")
        self._refuse(~seen, "measures nothing: its vector is zero",
                     "Give a functional that depends on the parameters")

    def _refuse(self, wrong: Any, problem: str, remedy: str) -> None:
        for i in np.flatnonzero(wrong):
            asked = f"({self.low[i]:g} to {self.high[i]:g}, softness {self.softness[i]:g})"
            name = f"constraint {self.labels[i]!r} at frame {self.frames[i]}"
            raise DnnvssError(f"{name} {asked} {problem}", remedy=remedy)

    def __len__(self) -> int:
        return len(self.labels)

    @classmethod
    def none(cls, columns: int) -> "Constraints":
        """Return an empty set for ``columns`` parameters."""
        return hold([], np.ones(columns), value=0.0)

    @classmethod
    def joined(cls, parts: Iterable["Constraints"]) -> "Constraints":
        """Return all constraints of several sets, in order; at least one set."""
        sets = list(parts)
        arrays: dict[str, Any] = {
            name: np.concatenate([getattr(p, name) for p in sets])
            for name in _ARRAYS
        }
        return cls(**arrays, labels=tuple(label for p in sets for label in p.labels))

    def taken(self, indices: np.ndarray) -> "Constraints":
        """Return the constraints at ``indices``, in that order."""
        arrays: dict[str, Any] = {name: getattr(self, name)[indices] for name in _ARRAYS}
        return Constraints(**arrays, labels=tuple(self.labels[i] for i in indices))

    def check(self, frames: int, windows: Windows) -> None:
        """Refuse constraints outside a trajectory, or on streams that the windows lack.

        Raises:
            DnnvssError: there is one.
        """
        for i in np.flatnonzero((self.frames < 0) | (self.frames >= frames) | (self.streams >= len(windows))):
            raise DnnvssError(
                f"constraint {self.labels[i]!r} is on stream {self.streams[i]} of frame {self.frames[i]}, and the "
                f"trajectory has {frames} frames of {len(windows)} streams",
                remedy="Give times inside the utterance",
            )

    def within(self, around: slice) -> "Constraints":
        """The constraints on a slice of the frames, counted from its start."""
        own = self.taken(np.flatnonzero((self.frames >= around.start) & (self.frames < around.stop)))
        return replace(own, frames=own.frames - around.start)

    def matrix(self, frames: int, windows: Windows) -> scipy.sparse.csr_array:
        """Return the functionals as a sparse matrix (M, T * D) over the trajectory read frame by frame.

        Raises:
            DnnvssError: a constraint outside the trajectory, or on a stream that the windows lack.
        """
        self.check(frames, windows)
        columns = self.vectors.shape[1]
        if not self.streams.any():  # each row looks at one frame
            index = self.frames[:, None] * columns + np.arange(columns)
            ends = columns * np.arange(len(self) + 1)
            return scipy.sparse.csr_array((self.vectors.ravel(), index.ravel(), ends), (len(self), frames * columns))
        rows, at, weights = [], [], []
        for w in range(len(windows)):
            own = np.flatnonzero(self.streams == w)
            for s, tap in windows.weights(w):
                rows.append(own)
                at.append(np.clip(self.frames[own] + s, 0, frames - 1))
                weights.append(np.full(len(own), tap))
        row, frame, weight = (np.concatenate(parts) for parts in (rows, at, weights))
        values = self.vectors[row] * weight[:, None]
        index = frame[:, None] * columns + np.arange(columns)
        shape = (len(self), frames * columns)
        return scipy.sparse.csr_array((values.ravel(), (np.repeat(row, columns), index.ravel())), shape=shape)


def hold(
    frames: Sequence[int] | np.ndarray,
    vector: np.ndarray,
    constant: float = 0.0,
    *,
    low: float = -np.inf,
    high: float = np.inf,
    value: float | None = None,
    softness: float | np.ndarray = 0.0,
    stream: int = 0,
    label: str | Sequence[str] = "",
) -> Constraints:
    """Return constraints that keep ``x[t] . vector + constant`` between ``low`` and ``high`` at each of some frames.

    Args:
        frames: the frames t.
        vector, constant: the functional, (D,) and a number, e.g. a gauge of a face.
        low, high: the range, in the functional's unit.
        value: instead of a range, the value to hold.
        softness: 0 holds it; a positive number in the functional's unit gives way; or one for each frame.
        stream: 0 for the trajectory itself, 1 for its delta (the constant then does not count).
        label: a word for messages, or one for each frame.
    """
    if value is not None:
        low = high = value
    offset = constant if stream == 0 else 0.0
    count = len(frames)
    return Constraints(
        frames=np.asarray(frames, dtype=np.int64).reshape(count),
        vectors=np.broadcast_to(np.asarray(vector, dtype=float), (count, len(vector))),
        low=np.full(count, low - offset),
        high=np.full(count, high - offset),
        softness=np.full(count, softness, float),
        streams=np.full(count, stream, dtype=np.int64),
        labels=(label,) * count if isinstance(label, str) else tuple(label),
    )


def constrain(
    trajectory: np.ndarray, variance: Any, constraints: Constraints, windows: Windows = STATIC_DELTA_DELTA2,
    equations: Callable[[], NormalEquations] | None = None,
) -> np.ndarray:
    """Return the trajectory (T, D) that keeps the constraints and is otherwise the most likely one.

    It minimises ``(x - x0)' W' V^-1 W (x - x0)`` plus ``(miss / softness)^2`` of every soft constraint, under the hard
    ones. With ``x0 = mlpg(mean, variance)`` that is the maximum-likelihood trajectory of the same prediction under the
    constraints: one quadratic programme, solved to rounding through its dual. Where ``x0`` keeps all
    constraints, or there are none, ``x0`` itself comes back, bit for bit. Time and memory are linear in T.

    Args:
        trajectory: x0, (T, D); after :func:`dnnvss.curves.variance.articulate` it may differ from plain MLPG.
        variance: the variances of the prediction, which broadcast to (T, W, D).
        constraints: what to keep.
        windows: the streams of the prediction.
        equations: gives :func:`equations_of` where several solves share them; made anew where None.

    Raises:
        DnnvssError: constraints that contradict one another (the worst is named), or lie outside the utterance.

    **Source**: the conditions of Karush, Kuhn and Tucker; Nocedal and Wright, Numerical Optimization (2006), chapter
        16.
    """
    start = np.asarray(trajectory)
    if constraints.vectors.shape[1:] != start.shape[1:]:
        raise DnnvssError(f"constraints on {constraints.vectors.shape[1]} parameters do not fit a trajectory of shape "
                          f"{start.shape}", remedy="Give functionals of the parameters of this model")
    if not len(constraints):
        return start
    problem = _Dual(start.astype(float), variance, constraints, windows, equations)
    return problem.solution().astype(start.dtype) if problem.broken else start


def equations_of(variance: Any, shape: tuple[int, ...], windows: Windows) -> NormalEquations:
    """P = W' V^-1 W of a prediction, factorised.

    Args:
        variance: what broadcasts to (T, W, D).
        shape: T and D.
        windows: the streams.
    """
    streams = (1, shape[0], len(windows), shape[1])
    return NormalEquations(precision_of(variance, streams), windows, None, streams)


class _Dual:
    """Finds the multipliers u of the constraints; the trajectory is ``x0 + P^-1 A' u``."""

    def __init__(self, start: np.ndarray, variance: Any, constraints: Constraints, windows: Windows,
                 equations: Callable[[], NormalEquations] | None) -> None:
        self.variance, self.windows, self._given = variance, windows, equations
        self.start, self.constraints = start, constraints.taken(np.argsort(constraints.frames, kind="stable"))
        self.rows = self.constraints.matrix(len(start), windows)
        self.low, self.high = self.constraints.low, self.constraints.high
        self.compliance = self.constraints.softness**2
        sizes = [np.where(np.isfinite(b), np.abs(b), 0.0) for b in (self.low, self.high)]
        self.scale = sizes[0] + sizes[1] + abs(self.rows) @ np.abs(start).ravel() + np.finfo(float).tiny

    @property
    def broken(self) -> bool:
        """Whether the trajectory that was given breaks a constraint."""
        reached = self.rows @ self.start.ravel()
        return bool(((reached < self.low) | (reached > self.high)).any())

    @cached_property
    def equations(self) -> NormalEquations:
        """P, factorised."""
        return self._given() if self._given else equations_of(self.variance, self.start.shape, self.windows)

    def solution(self) -> np.ndarray:
        """Return the trajectory; constraints that never come into play are not solved for.

        Raises:
            DnnvssError: the constraints contradict one another.
        """
        x = self.start
        working = np.zeros(len(self.low), dtype=bool)
        while (fresh := ~working & (self._miss(self.rows @ x.ravel()) > _TOLERANCE * self.scale)).any():
            working |= fresh
            x = self._settled(np.flatnonzero(working))
        return x

    def _settled(self, chosen: np.ndarray) -> np.ndarray:
        """Return the trajectory under the chosen constraints alone."""
        rows, low, high, compliance = self.rows[chosen], self.low[chosen], self.high[chosen], self.compliance[chosen]
        bands = influences(self.equations, rows, self.start.shape[1])
        bands[0] += compliance
        x, u, miss = self.start, np.zeros(len(chosen)), np.full(len(chosen), np.inf)
        for _ in range(_SWEEPS):
            reached = rows @ x.ravel() + compliance * u
            u = solve_ranges(bands, reached - multiply(bands, u), low, high, u if u.any() else None)
            x = self.start + self.equations.solve((rows.T @ u).reshape(len(x), 1, -1))[0]
            miss = self._miss(rows @ x.ravel() + compliance * u, u, chosen) / self.scale[chosen]
            if miss.max() <= _TOLERANCE:
                return x
        if miss.max() > _INFEASIBLE:
            raise self._contradiction(int(chosen[miss.argmax()]), x)
        return x

    def _miss(self, reached: np.ndarray, u: np.ndarray | float = 0.0, chosen: Any = slice(None)) -> np.ndarray:
        """Return how far each constraint is from its condition: inside its range, or on the bound that pushes."""
        low, high = self.low[chosen], self.high[chosen]
        above = np.where((u > 0) & (reached > low), reached - low, np.maximum(low - reached, 0.0))
        below = np.where((u < 0) & (reached < high), high - reached, np.maximum(reached - high, 0.0))
        return np.maximum(above, below)

    def _contradiction(self, worst: int, x: np.ndarray) -> DnnvssError:
        c = self.constraints
        value = (self.rows @ x.ravel())[worst]
        near = np.argsort(np.abs(c.frames - c.frames[worst]), kind="stable")[:4]
        rivals = ", ".join(f"{c.labels[i]!r} at frame {c.frames[i]}" for i in near if i != worst)
        return DnnvssError(
            f"the constraints contradict one another: {c.labels[worst]!r} at frame {c.frames[worst]} asks for "
            f"{c.low[worst]:g} to {c.high[worst]:g} and gets {value:g}, beside {rivals}",
            remedy="Take one of them out, widen a range, or make one soft",
        )
