"""What may be said of preferences: shares over viewers, majorities, exact tests, strengths, sides."""

from itertools import combinations

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.evaluation.cells import interval, p_value
from dnnvss.evaluation.statistics import holm
from dnnvss.evaluation.viewing.agreement import krippendorff
from dnnvss.evaluation.viewing.bradley_terry import fit_bradley_terry
from dnnvss.evaluation.viewing.judgements import Judgements
from dnnvss.evaluation.viewing.shares import exact_share, majorities, share_over_viewers
from dnnvss.evaluation.viewing.sheet import Sheet
from dnnvss.evaluation.viewing.tables import (
    Found,
    Score,
    Table,
    agreement_table,
    differences,
    names_of,
    over_viewers,
    own_means,
)


def preference(sheet: Sheet, judged: Judgements) -> Found:
    """What a preference test says."""
    names, over, exact, tested = names_of(sheet), list[list[str]](), list[tuple[str, ...]](), list[float]()
    for a, b in combinations(range(len(names)), 2):
        ahead, viewer = _ahead(judged, a, b)
        if not len(ahead):
            continue
        own = own_means(ahead, viewer)
        share = share_over_viewers(own)
        tested.append(share.p)
        over.append([names[a], names[b], str(len(ahead)), str(int((ahead == 0.5).sum())), interval(share),
                     p_value(share.p)])
        exact.append((names[a], names[b], *_exact(ahead, own)))
    rows = tuple((*row, p_value(p)) for row, p in zip(over, holm(tested), strict=True))
    tables = [
        Table("Preference", ("first", "second", "judgements", "ties", "share for the first, over viewers", "p",
                             "p (Holm)"), rows,
              ("The mean of the viewers' own shares, ties as halves, with the t interval: it holds for viewers who "
               "were not asked.",)),
        Table("Majorities and exact tests", ("first", "second", "viewers for the first", "their share, exact", "p",
                                             "judgements for the first, exact", "p"), tuple(exact),
              ("The exact test of all judgements takes each as independent of the others, which judgements of one "
               "viewer are not: it is given because papers print it, and says too much.",)),
        _sides(sheet, judged)]
    scores, more, warnings = _strengths(sheet, judged)
    agreement = krippendorff(_preferred(judged, len(names)), nominal=True)
    tables += [*more, agreement_table(agreement, "which is preferred", "tossing a coin")]
    return Found(scores, "share of all pairs in which it was preferred", tuple(tables), tuple(warnings))


def _exact(ahead: np.ndarray, own: np.ndarray) -> tuple[str, ...]:
    """Cells about viewers who were more often for the first, and about all judgements that are no ties."""
    first, second, even = majorities(own)
    voted = exact_share(first, first + second)
    judged = exact_share(int((ahead == 1).sum()), int((ahead != 0.5).sum()))
    counted = f"{first} of {first + second}" + (f", {even} even" if even else "")
    return counted, interval(voted), p_value(voted.p), interval(judged), p_value(judged.p)


def _ahead(judged: Judgements, a: int, b: int) -> tuple[np.ndarray, np.ndarray]:
    """How far a was preferred to b in each of their judgements, and by whom."""
    left, right = judged.condition.T
    straight, turned = (left == a) & (right == b), (left == b) & (right == a)
    ahead = np.where(turned, 1 - judged.value, judged.value)
    mask = straight | turned
    return ahead[mask], judged.viewer[mask]


def _preferred(judged: Judgements, conditions: int) -> np.ndarray:
    """Values (viewers, 2 * pairs of a sentence): 1 where the condition of the lower number was preferred, and then the
    same the other way round: which of two is named first is no matter, and so chance is one half."""
    low, high = judged.condition.min(axis=1), judged.condition.max(axis=1)
    item = (judged.sentence * conditions + low) * conditions + high
    _, item = np.unique(item, return_inverse=True)
    value = np.where(judged.condition[:, 0] == low, judged.value, 1 - judged.value)
    table = np.full((len(judged.viewers), int(item.max(initial=0)) + 1), np.nan)
    table[judged.viewer, item] = value
    return np.hstack([table, 1 - table])


def _sides(sheet: Sheet, judged: Judgements) -> Table:
    """Whether viewers have a side, whatever is on it."""
    left = share_over_viewers(own_means(judged.value, judged.viewer))
    return Table("The left side", ("share for the left", "p"), ((interval(left), p_value(left.p)),),
                 ("Sides are drawn so that they cancel out; a share far from one half tells of careless viewers.",))


def _strengths(sheet: Sheet, judged: Judgements) -> tuple[dict[str, Score], list[Table], list[str]]:
    """Shares of each condition that was judged against all others, and its strength where there are more than two."""
    names, left = names_of(sheet), judged.condition[:, 0]
    won = {n: np.where(left == k, judged.value, 1 - judged.value) for k, n in enumerate(names)}
    scores = {}
    for k, name in enumerate(names):
        mask = (judged.condition == k).any(axis=1)
        if mask.any():
            scores[name] = over_viewers(won[name][mask], judged.viewer[mask], share_over_viewers)
    if len(names) < 3:
        return scores, [], []
    try:
        fit = fit_bradley_terry(len(names), judged.condition, judged.value, judged.viewer)
    except DnnvssError as error:
        return scores, [], [f"Bradley-Terry: {error.problem}."]
    table = Table("Strength (Bradley-Terry)", ("condition", "strength"),
                  tuple((n, interval(Score(*map(float, row))))
                        for n, row in zip(names, np.stack([fit.strengths, fit.low, fit.high], 1), strict=True)),
                  ("On a logarithmic scale whose mean is 0: a condition that is stronger by 1 wins in 73 % of the "
                   "judgements. Intervals take all judgements of a viewer as one.",))
    return scores, [table, differences(names, fit.difference, "strength")], []
