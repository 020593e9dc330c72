"""What may be said of scores: means, ranks, tests that know who scored what, differences to a hidden reference."""

from collections.abc import Sequence

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.evaluation.cells import interval, number, p_value
from dnnvss.evaluation.statistics import holm
from dnnvss.evaluation.viewing.agreement import krippendorff
from dnnvss.evaluation.viewing.judgements import Judgements
from dnnvss.evaluation.viewing.mixed import MOST, fit_mixed
from dnnvss.evaluation.viewing.ranks import friedman, leaving_out, signed_rank
from dnnvss.evaluation.viewing.shares import mean_interval
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


def single(sheet: Sheet, judged: Judgements) -> Found:
    """What a test of single stimuli on a scale says."""
    names, count = names_of(sheet), len(sheet.conditions)
    table = judged.table(count)
    scores = {n: over_viewers(judged.value[judged.condition == k], judged.viewer[judged.condition == k], mean_interval)
              for k, n in enumerate(names) if (judged.condition == k).any()}
    tables = [Table("Mean opinion", ("condition", "judgements", "mean of viewers", "median"), tuple(
        (n, str(int((judged.condition == k).sum())), interval(scores[n], 1),
         number(float(np.median(judged.value[judged.condition == k])), 1))
        for k, n in enumerate(names) if n in scores), ("0 is the left end of the scale and 100 the right one.",))]
    tables += _kruskal(sheet, judged)
    more, warnings = _together(names, judged, table)
    tables += [*more, *_signed_ranks(sheet, judged)]
    alpha = krippendorff(judged.grid(count, len(sheet.sentences)))
    return Found(scores, "points of 100", (*tables, agreement_table(alpha, "scores")), tuple(warnings))


def _equal(p: float) -> str:
    """A p in a sentence."""
    return p_value(p) if p < 1e-4 else f"= {p_value(p)}"


def _kruskal(sheet: Sheet, judged: Judgements) -> list[Table]:
    """Kruskal-Wallis over all conditions, and with anchors left out, as Theobald et al. (2003) print it."""
    names = names_of(sheet)
    groups = {n: judged.value[judged.condition == k] for k, n in enumerate(names) if (judged.condition == k).any()}
    lows = [c.name for c in sheet.conditions if c.shows in ("random", "frozen")]
    highs = [c.name for c in sheet.conditions if c.shows in ("recording", "through")]
    sets = [tuple(s) for s in (lows, [*lows, *highs]) if s]
    tables = []
    for left, test in leaving_out(groups, sets).items():
        kept = [n for n in groups if n not in left]
        rows = tuple((n, str(test.counts[k]), number(test.medians[k], 1), number(test.ranks[k], 1),
                      number(test.z[k], 2)) for k, n in enumerate(kept))
        tables.append(Table("Kruskal-Wallis" + (f" without {', '.join(left)}" if left else ""),
                            ("condition", "n", "median", "average rank", "Z"), rows,
                            (f"H = {test.statistic:.2f} ({test.adjusted:.2f} corrected for ties), "
                             f"p {_equal(test.p)}, degrees of freedom {len(kept) - 1}. The test takes all "
                             "scores as independent, which scores of one viewer are not.",)))
    return tables


def _together(names: Sequence[str], judged: Judgements, table: np.ndarray) -> tuple[list[Table], list[str]]:
    """Tests that know that a viewer scored several things: Friedman, and the mixed model."""
    tables, warnings = list[Table](), list[str]()
    whole = table[~np.isnan(table).any(axis=1)]
    if len(whole) > 1 and table.shape[1] > 1:
        test = friedman(whole)
        tables.append(Table("Friedman", ("viewers", "chi-squared", "degrees of freedom", "p", "Kendall's W"),
                            ((str(len(whole)), number(test.statistic, 2), str(len(names) - 1), p_value(test.p),
                              number(test.agreement)),),
                            ("Of the viewers' means of each condition; W is how far viewers put the conditions in one "
                             "order.",)))
    if len(judged.value) > MOST:
        warnings.append(f"{len(judged.value)} scores are more than the mixed model is fitted to ({MOST}).")
    elif len(whole) > 1:
        try:
            fit = fit_mixed(judged.value, judged.condition, judged.viewer, judged.sentence, names)
        except DnnvssError as error:
            return tables, [f"Mixed model: {error}."]
        made = differences(names, fit.difference, "score (mixed model)", 1)
        note = (f"Viewers, sentences and viewers' own tastes are random; variances: viewers {fit.viewers:.1f}, "
                f"sentences {fit.sentences:.1f}, rest {fit.rest:.1f}.")
        tables.append(Table(made.title, made.head, made.rows, (note,)))
    return tables, warnings


def _signed_ranks(sheet: Sheet, judged: Judgements) -> list[Table]:
    """Each viewer's signed rank test of the sentences' scores, where there are two conditions."""
    if len(sheet.conditions) != 2:
        return []
    grid = judged.grid(2, len(sheet.sentences)).reshape(len(judged.viewers), 2, -1)
    return _per_viewer(judged.viewers, grid[:, 0] - grid[:, 1], names_of(sheet)[0], names_of(sheet)[1])


def _per_viewer(viewers: Sequence[str], differences: np.ndarray, first: str, second: str) -> list[Table]:
    """The signed rank tests of differences (viewers, sentences)."""
    rows, means = [], []
    for name, row in zip(viewers, differences, strict=True):
        d = row[~np.isnan(row)]
        if len(d):
            test = signed_rank(d)
            means.append(float(d.mean()))
            rows.append((name, str(test.count), str(test.used), number(test.statistic, 1), p_value(test.p),
                         number(test.median, 2)))
    over = mean_interval(np.array(means))
    note = (f"{first} less {second}. Over viewers the mean difference is {interval(over, 1)}, p {_equal(over.p)}. "
            "A viewer's p says that this viewer would judge so again, not that others do.")
    return [Table(f"Each viewer (Wilcoxon signed rank): {first} and {second}", ("viewer", "N", "n", "W", "p", "median"),
                  tuple(rows), (note,))]


def dscqs(sheet: Sheet, judged: Judgements) -> Found:
    """Differences to the hidden reference, by condition."""
    every, reference = names_of(sheet), str(sheet.design["reference"])
    names, points = [name for name in every if name != reference], judged.less(every.index(reference))
    table, cells = points.table(len(names)), points.grid(len(names), len(sheet.sentences))
    grid = cells.reshape(len(points.viewers), len(names), -1)
    rows, tables, scores, tested = list[list[str]](), list[Table](), dict[str, Score](), list[float]()
    for k, name in enumerate(names):
        mask = points.condition == k
        if not mask.any():
            continue
        over = mean_interval(own_means(points.value[mask], points.viewer[mask]))
        scores[name] = Score.of(over)
        tested.append(over.p)
        rows.append([name, str(int(mask.sum())), interval(over, 1), p_value(over.p)])
        tables += _per_viewer(points.viewers, grid[:, k], name, reference)
    rows = [[*row, p_value(p)] for row, p in zip(rows, holm(tested), strict=True)]
    head = ("condition", "pairs", "points, over viewers", "p", "p (Holm)")
    summary = Table("Difference to the hidden reference", head, tuple(map(tuple, rows)),
                    (f"The reference is {reference}; negative: rated below it.",))
    more, warnings = _together(names, points, table) if len(names) > 1 else ([], [])
    single = judged.single()
    alpha = krippendorff(single.grid(len(every), len(sheet.sentences)))
    return Found(scores, f"points of 100 above {reference}",
                 (summary, *_kruskal(sheet, single), *more, *tables, agreement_table(alpha, "scores")), tuple(warnings))
