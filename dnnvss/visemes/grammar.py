"""What is known of sequences of dynamic visemes before anything is said: which follows which, and how long it lasts."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dnnvss.archives import Held, check_arrays
from dnnvss.errors import DnnvssError

_SHRINK = 4.0  # gestures of the average unit that every unit's durations are mixed with
_HELD = {"follow": Held(("U", "U")), "first": Held(("U",)), "last": Held(("U",)), "duration": Held(("L", "U")),
         "share": Held(("U",))}
_ARRAYS = tuple(_HELD)


@dataclass(frozen=True)
class Grammar:
    """A bigram of U units and a distribution of durations for each. Build with :meth:`of`.

    Args:
        follow: (U, U), log probability that unit ``v`` (column) follows unit ``u`` (row).
        first: (U,), log probability that a sequence begins with the unit.
        last: (U,), log probability that it ends after the unit.
        duration: (L, U), log probability that a unit lasts 1, 2, ..., L frames.
        share: (U,), log share of the frames that a unit owns.
    """

    follow: np.ndarray
    first: np.ndarray
    last: np.ndarray
    duration: np.ndarray
    share: np.ndarray

    @classmethod
    def of(cls, sequences: Sequence[tuple[np.ndarray, np.ndarray]], units: int) -> "Grammar":
        """Return what sequences tell.

        The bigram is smoothed as Witten and Bell do: ``p(v|u) = (c(u, v) + n(u) p(v)) / (c(u) + n(u))``, where ``n(u)``
        counts the different units seen after ``u``. The log of a duration is normal; its mean and variance in each unit
        are shrunk towards those of all units.

        Args:
            sequences: units (G,) and their frames (G,), of each training utterance; units without a frame left out.
            units: U.

        Raises:
            DnnvssError: no sequence.

        **Source**: Witten and Bell, "The zero-frequency problem", 1991.
        """
        if not sequences:
            raise DnnvssError("no sequence of dynamic visemes to learn from", remedy="Give training utterances")
        every = np.concatenate([u for u, _ in sequences])
        frames = np.concatenate([d for _, d in sequences])
        edge = units  # stands before the first unit and after the last
        counts = np.zeros((units + 1, units + 1))
        for sequence, _ in sequences:
            path = np.concatenate([[edge], sequence, [edge]])
            np.add.at(counts, (path[:-1], path[1:]), 1)
        after = counts.sum(axis=0) + 1
        kinds = np.maximum((counts > 0).sum(axis=1, keepdims=True), 1)
        follow = np.log((counts + kinds * after / after.sum()) / (counts.sum(axis=1, keepdims=True) + kinds))
        owned = np.bincount(every, frames, minlength=units) + 1
        return cls(follow[:edge, :edge], follow[edge, :edge], follow[:edge, edge], _durations(every, frames, units),
                   np.log(owned / owned.sum()))

    def describe(self) -> dict[str, Any]:
        """Return the arrays for a checkpoint."""
        return {name: getattr(self, name) for name in _ARRAYS}

    @classmethod
    def from_description(cls, description: Mapping[str, Any]) -> "Grammar":
        """Return the grammar that :meth:`describe` described.

        Raises:
            DnnvssError: an array is absent or of another shape.
        """
        arrays = {name: np.asarray(description[name]) for name in _ARRAYS if name in description}
        check_arrays(arrays, _HELD, None, "Train the run anew")
        return cls(**arrays)

    def __len__(self) -> int:
        """The number of units."""
        return len(self.first)


def _durations(units: np.ndarray, frames: np.ndarray, count: int) -> np.ndarray:
    """Return (L, U) log probabilities of 1 to L frames, L the longest seen."""
    logs = np.log(frames)
    known = np.bincount(units, minlength=count)
    mean = (np.bincount(units, logs, minlength=count) + _SHRINK * logs.mean()) / (known + _SHRINK)
    squares = np.bincount(units, (logs - mean[units]) ** 2, minlength=count)
    deviation = np.sqrt((squares + _SHRINK * max(logs.var(), 1e-2)) / (known + _SHRINK))
    length = np.arange(1, int(frames.max()) + 1)[:, None]
    density = -0.5 * ((np.log(length) - mean) / deviation) ** 2 - np.log(length * deviation)
    return density - np.log(np.exp(density).sum(axis=0))
