"""Gestures of one length put into units: one algorithm, two notions of distance."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from dnnvss.errors import DnnvssError

_ROUNDS = 30  # of Lloyd's algorithm
_REPAIRS = 8  # rounds of dissolving rare units and splitting wide ones
_CELLS = 1 << 20  # numbers in a row of the warping grids that are filled at once


class Method(ABC):
    """A distance between gestures and the centre of a set of them; gestures are arrays (R, K)."""

    @abstractmethod
    def distances(self, gestures: np.ndarray, centres: np.ndarray) -> np.ndarray:
        """Return the distances (G, U), not negative, of gestures (G, R, K) from centres (U, R, K)."""

    @abstractmethod
    def centre(self, gestures: np.ndarray) -> np.ndarray:
        """Return the centre (R, K) of gestures (G, R, K), G at least 1."""


class KMeans(Method):
    """Squared Euclidean distance of gestures brought to one length; the centre is the mean."""

    def distances(self, gestures: np.ndarray, centres: np.ndarray) -> np.ndarray:
        """Return ``|g - c|^2 / R``, (G, U)."""
        g, c = gestures.reshape(len(gestures), -1), centres.reshape(len(centres), -1)
        squared = (g**2).sum(1)[:, None] + (c**2).sum(1)[None] - g @ (2 * c.T)
        return np.maximum(squared, 0) / gestures.shape[1]

    def centre(self, gestures: np.ndarray) -> np.ndarray:
        """Return the mean gesture (R, K)."""
        return gestures.mean(axis=0)


class DtwMedoids(Method):
    """Dynamic time warping; the centre is the medoid, the member nearest to all others.

    Of the alignments of two gestures that are monotonic and join their ends, the one with the least summed squared
    distance counts; steps are (1, 0), (0, 1) and (1, 1), and the sum is divided by R.
    """

    _MOST = 120  # members among which a medoid is sought, evenly spread over them

    def distances(self, gestures: np.ndarray, centres: np.ndarray) -> np.ndarray:
        """Return the warped squared distances (G, U)."""
        step = max(1, _CELLS // (len(centres) * gestures.shape[1]))
        return np.concatenate([_dtw(gestures[i : i + step], centres) for i in range(0, len(gestures), step)])

    def centre(self, gestures: np.ndarray) -> np.ndarray:
        """Return the medoid (R, K)."""
        some = gestures[np.linspace(0, len(gestures) - 1, min(len(gestures), self._MOST)).astype(int)]
        return some[self.distances(some, some).sum(axis=0).argmin()]


METHODS: dict[str, type[Method]] = {"kmeans": KMeans, "dtw": DtwMedoids}
"""The methods by name."""


def _dtw(gestures: np.ndarray, centres: np.ndarray) -> np.ndarray:
    """Return the distances (G, U), all pairs at once: one step of the recursion a cell of the R x R grid."""
    length = gestures.shape[1]
    g, c = (np.ascontiguousarray(x.transpose(1, 0, 2), dtype=np.float32) for x in (gestures, centres))
    g_norms, c_norms = (g**2).sum(2), (c**2).sum(2)
    row = np.empty((length, len(gestures), len(centres)), np.float32)
    for i in range(length):
        before = row.copy() if i else row
        for j in range(length):
            cost = g[i] @ (-2 * c[j].T) + g_norms[i][:, None] + c_norms[j]
            np.maximum(cost, 0, out=cost)
            if i and j:
                cost += np.minimum(np.minimum(before[j], before[j - 1]), row[j - 1])
            elif i or j:
                cost += before[j] if i else row[j - 1]
            row[j] = cost
    return row[-1].astype(float) / length


@dataclass(frozen=True)
class Partition:
    """Gestures in units.

    Args:
        centres: (U, R, K).
        members: the unit (G,) of each gesture.
        spread: mean distance of the gestures from their centres.
    """

    centres: np.ndarray
    members: np.ndarray
    spread: float


def partition(gestures: np.ndarray, units: int, method: Method, least: int = 10, starts: int = 3,
              seed: int = 0) -> Partition:
    """Return gestures (G, R, K) in at most ``units`` units of at least ``least`` members each.

    Lloyd's algorithm from several k-means++ starts; then, in turns, units with too few members are dissolved into their
    neighbours and the widest units are split in two, as long as both halves are large enough. Where the gestures do not
    suffice for ``units`` such units there are fewer.

    Args:
        gestures: all of one length R, their coefficients scaled as they are to count.
        units: how many are wanted.
        method: distance and centre.
        least: members that a unit needs.
        starts: the best of so many starts is kept.
        seed: of the starts.

    Raises:
        DnnvssError: there are too few gestures for a single unit.
    """
    if len(gestures) < least or units < 1:
        raise DnnvssError(f"{len(gestures)} gestures are too few for {max(units, 1)} units of {least} members",
                          remedy="Take more training sentences, or a smaller visemes.least")
    random = np.random.default_rng(seed)
    wanted = min(units, len(gestures) // least)
    found = [_lloyd(gestures, _seeds(gestures, wanted, method, random), method) for _ in range(starts)]
    best = _dissolved(gestures, min(found, key=lambda p: p.spread), method, least)
    for _ in range(_REPAIRS):
        centres = _split(gestures, best, method, least, wanted, random)
        if len(centres) == len(best.centres):
            break
        settled = _dissolved(gestures, _lloyd(gestures, centres, method), method, least)
        if len(settled.centres) <= len(best.centres):  # strays drew the new centres to themselves: leave them in place
            settled = _dissolved(gestures, _assigned(gestures, centres, method), method, least)
        best = settled
    return best


def _seeds(gestures: np.ndarray, units: int, method: Method, random: np.random.Generator) -> np.ndarray:
    """Return centres (U, R, K) drawn far apart. **Source**: Arthur and Vassilvitskii, "k-means++", 2007."""
    chosen = [int(random.integers(len(gestures)))]
    nearest = method.distances(gestures, gestures[chosen])[:, 0]
    while len(chosen) < units and nearest.sum() > 0:
        chosen.append(int(random.choice(len(gestures), p=nearest / nearest.sum())))
        nearest = np.minimum(nearest, method.distances(gestures, gestures[chosen[-1:]])[:, 0])
        nearest[chosen[-1]] = 0  # rounding may leave a gesture at a little distance from itself
    return gestures[chosen]


def _lloyd(gestures: np.ndarray, centres: np.ndarray, method: Method) -> Partition:
    """Return the partition that assigning and centring in turns settles in; empty units are left out."""
    found = _assigned(gestures, centres, method)
    for _ in range(_ROUNDS):
        moved = _assigned(gestures, _centred(gestures, found, method), method)
        if len(moved.centres) == len(found.centres) and (moved.members == found.members).all():
            return moved
        found = moved
    return found


def _centred(gestures: np.ndarray, found: Partition, method: Method) -> np.ndarray:
    """Return the centres (U, R, K) of a partition's members."""
    return np.stack([method.centre(gestures[found.members == u]) for u in range(len(found.centres))])


def _assigned(gestures: np.ndarray, centres: np.ndarray, method: Method) -> Partition:
    distances = method.distances(gestures, centres)
    used, members = np.unique(distances.argmin(axis=1), return_inverse=True)
    return Partition(centres[used], members, float(distances.min(axis=1).mean()))


def _dissolved(gestures: np.ndarray, found: Partition, method: Method, least: int) -> Partition:
    """Return the partition with its rarest unit given up, again and again until all have enough members."""
    while len(found.centres) > 1 and np.bincount(found.members).min() < least:
        distances = method.distances(gestures, found.centres)
        kept = np.arange(len(found.centres))
        while len(kept) > 1:
            counts = np.bincount(distances[:, kept].argmin(axis=1), minlength=len(kept))
            if counts.min() >= least:
                break
            kept = np.delete(kept, counts.argmin())
        found = _assigned(gestures, found.centres[kept], method)
        found = _assigned(gestures, _centred(gestures, found, method), method)
    return found


def _split(gestures: np.ndarray, found: Partition, method: Method, least: int, wanted: int,
           random: np.random.Generator) -> np.ndarray:
    """Return the centres with those of the widest units cut in two of enough members, until there are ``wanted``."""
    distances = method.distances(gestures, found.centres)[np.arange(len(gestures)), found.members]
    width = np.bincount(found.members, distances)
    centres = list(found.centres)
    for unit in np.argsort(-width):
        if len(centres) == wanted:
            break
        halves = _halves(gestures[found.members == unit], method, least, random)
        if len(halves):
            centres[unit] = halves[0]
            centres.append(halves[1])
    return np.stack(centres)


def _halves(own: np.ndarray, method: Method, least: int, random: np.random.Generator) -> np.ndarray:
    """Return two centres (2, R, K) that cut a unit's gestures in large enough halves, none where that cannot be.

    A few strays make a half of their own: they are set aside, and the rest is tried again.
    """
    while len(own) >= 2 * least:
        halves = _lloyd(own, _seeds(own, 2, method, random), method)
        counts = np.bincount(halves.members)
        if len(counts) < 2 or counts.min() >= least:
            return halves.centres if len(counts) == 2 else halves.centres[:0]
        own = own[halves.members == counts.argmax()]
    return own[:0]
