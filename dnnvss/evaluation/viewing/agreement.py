"""How far viewers agree with each other, whatever they say."""

import numpy as np


def krippendorff(ratings: np.ndarray, nominal: bool = False) -> float:
    """Krippendorff's alpha: 1 where viewers agree, 0 where as much as by chance; NaN where nothing varies.

    Args:
        ratings: (viewers, items), NaN where a viewer was not asked.
        nominal: whether ratings are names; else their squared distance counts.

    **Source**: Krippendorff, Computing Krippendorff's alpha-reliability (2011).
    """
    known = ~np.isnan(ratings)
    asked = known.sum(axis=0) > 1
    ratings, known = ratings[:, asked], known[:, asked]
    counts = known.sum(axis=0).astype(float)
    total = counts.sum()
    if total < 2:
        return float("nan")
    if nominal:
        names = np.unique(ratings[known])
        tables = np.stack([(ratings == name).sum(axis=0) for name in names], axis=1).astype(float)
        within = ((counts ** 2 - (tables ** 2).sum(axis=1)) / (counts - 1)).sum()
        between = total ** 2 - (tables.sum(axis=0) ** 2).sum()
    else:
        x = np.where(known, ratings, 0.0) - ratings[known].mean()
        x = np.where(known, x, 0.0)
        within = (2 * (counts * (x ** 2).sum(axis=0) - x.sum(axis=0) ** 2) / (counts - 1)).sum()
        between = 2 * (total * (x ** 2).sum() - x.sum() ** 2)
    return float(1 - (total - 1) * within / between) if between > 0 else float("nan")
