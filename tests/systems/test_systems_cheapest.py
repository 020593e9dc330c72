"""The cheapest path through rows of candidates, against all paths."""

from itertools import pairwise, product

import numpy as np

from dnnvss.systems.cheapest import cheapest_path


def test_no_other_path_costs_less() -> None:
    rng = np.random.default_rng(3)
    for sizes in ([1], [4], [2, 3, 1, 4], [3, 3, 3]):
        costs = [rng.random(n) for n in sizes]
        joins = [rng.random(pair) for pair in pairwise(sizes)]

        def whole(path: tuple[int, ...], costs: list = costs, joins: list = joins) -> float:
            steps = sum(join[a, b] for join, (a, b) in zip(joins, pairwise(path), strict=True))
            return float(sum(own[k] for own, k in zip(costs, path, strict=True)) + steps)

        assert tuple(cheapest_path(costs, joins)) == min(product(*map(range, sizes)), key=whole)
