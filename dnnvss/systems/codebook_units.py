"""What a codebook is made of: recorded trajectories, cut by phone, and how alike phones look."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.features import phones_of
from dnnvss.phones import PHONES, nearest
from dnnvss.systems.base import Example

OUTSIDE = len(PHONES)
"""The code of what lies before the first and after the last phone of an utterance."""
SAMPLES = 5
_ARRAYS = ("static", "bounds", "code", "first", "frames", "owner", "usable")


@dataclass(frozen=True)
class Inventory:
    """Static trajectories of utterances, one after the other, and their phones.

    Args:
        ids: of the utterances.
        static: (F, D) float32.
        bounds: (utterances + 1,) frames where utterances begin, and F.
        code: (P,) phone codes; every phone counts as context, one without a frame too.
        first, frames: (P,) first frame of each phone and how many it has.
        owner: (P,) its utterance.
        usable: (P,) bool, whether it has frames and all of them were measured.
    """

    ids: tuple[str, ...]
    static: np.ndarray
    bounds: np.ndarray
    code: np.ndarray
    first: np.ndarray
    frames: np.ndarray
    owner: np.ndarray
    usable: np.ndarray

    @classmethod
    def of(cls, examples: Sequence[Example]) -> "Inventory":
        """Return the inventory of measured examples.

        Raises:
            DnnvssError: no phone was measured throughout.
        """
        static = np.concatenate([e.measured[0][:, 0] for e in examples]).astype(np.float32)
        bounds = np.cumsum([0, *(len(e.codes) for e in examples)])
        valid = np.concatenate([e.measured[1] for e in examples])
        phones = [phones_of(e.codes) for e in examples]
        code, first, frames = (np.concatenate([getattr(p, name) for p in phones])
                               for name in ("code", "start", "frames"))
        owner = np.repeat(np.arange(len(examples)), [len(p.code) for p in phones])
        first = first + bounds[owner]
        unmeasured = np.append(0, np.cumsum(~valid))
        usable = (frames > 0) & (unmeasured[first + frames] == unmeasured[first])
        if not usable.any():
            raise DnnvssError("no phone of the training examples was measured throughout",
                              remedy="Train on measured utterances")
        return cls(tuple(e.id for e in examples), static, bounds, code, first, frames, owner, usable)

    @cached_property
    def slopes(self) -> np.ndarray:
        """Slope at each frame (F, D), a frame: zero at extrema, elsewhere the harmonic mean of both sides.

        With these the Hermite interpolant never leaves the range of its two frames, so that a mouth opens no further
        than it did. **Source**: Theobald et al. 2003, section 4 (why Hermite); Fritsch and Carlson 1980 (the slopes).
        """
        rise = np.diff(self.static.astype(np.float64), axis=0)
        rise[self.bounds[1:-1] - 1] = 0  # nothing runs from one utterance into the next
        before, after = rise[:-1], rise[1:]
        product = before * after
        slopes = np.zeros_like(self.static, dtype=np.float64)
        np.divide(2 * product, before + after, out=slopes[1:-1], where=product > 0)
        return slopes

    def at(self, times: np.ndarray, owner: np.ndarray) -> np.ndarray:
        """Return the interpolated parameters (..., D) at times in frames; beyond the utterance its end is held.

        Args:
            times: (...) places on the axis of ``static``; whole numbers are frames.
            owner: (...) the utterance of each.
        """
        low, high = self.bounds[owner], self.bounds[owner + 1] - 1
        times = np.clip(times, low, high)
        left = np.floor(times).astype(np.int64)
        right = np.minimum(left + 1, high)
        u = (times - left)[..., None]
        a, b = self.static[left].astype(np.float64), self.static[right].astype(np.float64)
        bent = u * (1 - u) * ((1 - u) * self.slopes[left] - u * self.slopes[right])
        return a + (b - a) * (u * u * (3 - 2 * u)) + bent

    def contexts(self, width: int) -> np.ndarray:
        """Return the codes (P, 2 * width) of the neighbours, left ones first, the nearest of each side first."""
        return neighbours(self.code, self.owner, width)

    def state(self) -> dict[str, Any]:
        """Return ids and arrays as plain containers."""
        return {"ids": list(self.ids)} | {n: getattr(self, n) for n in _ARRAYS}

    @classmethod
    def from_state(cls, state: dict[str, Any]) -> "Inventory":
        """Return the inventory that :meth:`state` described."""
        return cls(tuple(state["ids"]), **{name: state[name] for name in _ARRAYS})


def neighbours(code: np.ndarray, owner: np.ndarray, width: int) -> np.ndarray:
    """Return the codes (P, 2 * width) around each phone: 1 to ``width`` left of it, then right of it."""
    columns = []
    for offset in [*range(-1, -width - 1, -1), *range(1, width + 1)]:
        index = np.arange(len(code)) + offset
        inside = (index >= 0) & (index < len(code))
        index = np.clip(index, 0, len(code) - 1)
        columns.append(np.where(inside & (owner[index] == owner), code[index], OUTSIDE))
    return np.stack(columns, 1) if columns else np.zeros((len(code), 0), dtype=np.int64)


def phone_distances(corpus: Inventory) -> np.ndarray:
    """Return how different every two phones look (41, 41), 0 on the diagonal; the median of known pairs is 1.

    Equation 1 of the source is lost in print. From the words around it, with ``P_i`` (5, D) the mean of phone ``i`` at
    five equidistant points from its first to its last moment:

        ``D_ij = sqrt(v_i v_j sum_k w_k sum_l (P_i[l, k] - P_j[l, k])^2)``

    ``w_k``, the significance of parameter ``k``, is its share of all variance. ``v_i`` is proportional to the area
    between the mean trajectory and the observed ones, averaged over observations (in the words, their total; an average
    does not grow with how often a phone was said) and over parameters by ``w``. That a product of both weights is
    meant, and a root, are our reading. A phone never seen takes the place of the nearest one by articulation.

    **Source**: Theobald et al. 2003, section 4.2.
    """
    variance = corpus.static.var(0, dtype=np.float64)
    share = variance / max(variance.sum(), 1e-300)
    known = np.unique(corpus.code[corpus.usable])
    mean = np.zeros((len(PHONES), SAMPLES, len(share)))
    area = np.zeros(len(PHONES))
    for phone in known:
        rows = np.flatnonzero(corpus.usable & (corpus.code == phone))
        places = corpus.first[rows, None] - 0.5 + corpus.frames[rows, None] * np.linspace(0, 1, SAMPLES)
        seen = corpus.at(places, np.repeat(corpus.owner[rows, None], SAMPLES, 1))
        mean[phone] = seen.mean(0)
        area[phone] = (np.abs(seen - mean[phone]).mean((0, 1)) * share).sum()
    area = np.maximum(area, 1e-3 * area.max()) if area.any() else np.ones_like(area)
    stands = stand_ins(known)
    mean, area = mean[stands], area[stands]
    squared = (share * (mean[:, None] - mean[None]) ** 2).sum((-1, -2))
    distance = np.sqrt(area[:, None] * area[None] * squared)
    between = distance[np.ix_(known, known)][~np.eye(len(known), dtype=bool)]
    typical = float(np.median(between)) if len(between) else 0.0
    return distance / typical if typical > 0 else distance


def stand_ins(known: np.ndarray) -> np.ndarray:
    """Return for each phone code (41,) the code itself if known, else the nearest known one by articulation."""
    names = [PHONES[code] for code in known]
    return np.array([PHONES.index(nearest(phone, names)[0][0]) for phone in PHONES])


def similarities(distances: np.ndarray, gamma: float) -> np.ndarray:
    """Return ``exp(-gamma * distances)`` (42, 42); outside the utterance is like itself (1) and like no phone (0).

    **Source**: Theobald et al. 2003, equation 2.
    """
    out = np.zeros((OUTSIDE + 1, OUTSIDE + 1))
    out[:OUTSIDE, :OUTSIDE] = np.exp(-gamma * distances)
    out[OUTSIDE, OUTSIDE] = 1
    return out
