"""The choice of one candidate a place that costs least in all: dynamic programming, for systems of recorded pieces."""

from collections.abc import Iterable, Sequence

import numpy as np


def cheapest_path(costs: Sequence[np.ndarray], joins: Iterable[np.ndarray]) -> list[int]:
    """The candidate of each place whose costs, with those of the joins between neighbours, add up to the least.

    Args:
        costs: of the candidates (n_k,) of each place.
        joins: of each candidate of a place with each of the next, (n_k, n_k+1), one less than there are places.
    """
    total, back = costs[0], list[np.ndarray]()
    for join, own in zip(joins, costs[1:], strict=True):
        steps = total[:, None] + join
        back.append(steps.argmin(axis=0))
        total = steps.min(axis=0) + own
    path = [int(total.argmin())]
    for pointers in reversed(back):
        path.append(int(pointers[path[-1]]))
    return path[::-1]
