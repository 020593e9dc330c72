"""Who sees what: lists of trials by Latin squares, in orders of their own."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

Cell = tuple[int, int]
"""A sentence and a treatment, by their numbers."""
ORDERS = 24
"""Lists at least: where fewer show all cells equally often, these are given out again in other orders, because what all
viewers see in one order is judged by that order, too."""


def list_count(sentences: int, per_viewer: int, treatments: int, every: bool, ways: int) -> int:
    """How many lists there are: the fewest that show every cell equally often, as often as it takes to :data:`ORDERS`.

    Args:
        sentences: there are.
        per_viewer: that a viewer sees.
        treatments: of a sentence, ways round counted.
        every: whether a viewer sees a sentence by all conditions or pairs, each one way round.
        ways: in which a pair may stand, 1 where there is no pair.
    """
    blocks = sentences // math.gcd(sentences, per_viewer)
    fewest = blocks * (ways if every else treatments)
    return fewest * math.ceil(ORDERS / fewest)


def cells_of(number: int, sentences: int, per_viewer: int, treatments: int, every: bool, ways: int) -> list[Cell]:
    """The cells of a list.

    Sentence s has treatment (s + list) modulo their number, a Latin square; a block of sentences is seen by all
    treatments before the next begins. Where a viewer sees every pair of a sentence, the list decides which way round.

    Args:
        number: of the list, from 0.
        sentences, per_viewer, treatments, every, ways: as :func:`list_count` takes them.
    """
    shifts = ways if every else treatments
    first = (number // shifts) * per_viewer
    shown = [(first + k) % sentences for k in range(per_viewer)]
    if not every:
        return [(s, (s + number) % treatments) for s in shown]
    pairs = treatments // ways
    return [(s, pair + pairs * ((s + pair + number) % ways)) for s in shown for pair in range(pairs)]


def ordered(cells: Sequence[Cell], seed: int, number: int) -> list[Cell]:
    """The cells of a list in a random order in which no sentence follows itself, where that can be.

    **Source**: Recommendation ITU-R BT.500-15: no sequence is shown twice in succession.
    """
    rng = np.random.default_rng([seed, number])
    order = [cells[int(i)] for i in rng.permutation(len(cells))]
    for k in range(1, len(order)):
        if order[k][0] == order[k - 1][0]:
            free = [j for j in range(len(order)) if _fits(order, k, j)]
            if free:
                j = int(rng.choice(free))
                order[k], order[j] = order[j], order[k]
    return order


def _fits(order: Sequence[Cell], k: int, j: int) -> bool:
    """Whether two places may be exchanged without a sentence beside itself."""
    swapped = list(order)
    swapped[k], swapped[j] = swapped[j], swapped[k]
    near = {i for place in (k, j) for i in (place, place + 1) if 0 < i < len(order)}
    return all(swapped[i][0] != swapped[i - 1][0] for i in near)


def check_places(trials: int, checks: int, seed: int, number: int) -> list[int]:
    """Before which trials attention checks stand: one in each of equal stretches, none before the second trial."""
    rng = np.random.default_rng([seed, number, 1])
    edges = np.linspace(min(1, trials), trials, checks + 1)
    return [int(rng.integers(int(a), max(int(b), int(a) + 1))) for a, b in pairwise(edges)]
