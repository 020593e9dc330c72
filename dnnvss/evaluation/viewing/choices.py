"""What may be said of choices about one stimulus: what is called real, which words are told."""

import numpy as np

from dnnvss.evaluation.cells import NONE, interval, number, p_value
from dnnvss.evaluation.viewing.agreement import krippendorff
from dnnvss.evaluation.viewing.judgements import Judgements
from dnnvss.evaluation.viewing.shares import Share, exact_share, mean_interval, sensitivity, share_over_viewers
from dnnvss.evaluation.viewing.sheet import Sheet
from dnnvss.evaluation.viewing.tables import (
    Found,
    Score,
    Table,
    agreement_table,
    differences,
    names_of,
    own_means,
)


def turing(sheet: Sheet, judged: Judgements) -> Found:
    """What a test of real or synthetic says."""
    names = names_of(sheet)
    scores, tables = _rates(sheet, judged, "called real", 0.5)
    real = [k for k, c in enumerate(sheet.conditions) if c.shows in ("recording", "through")]
    rows = []
    for k, name in enumerate(names):
        if k in real or not real:
            continue
        hits = judged.value[np.isin(judged.condition, real)]
        false = judged.value[judged.condition == k]
        rows.append((name, number(sensitivity((int(hits.sum()), len(hits)), (int(false.sum()), len(false))), 2)))
    warnings = [] if real else ["No condition is real: whether viewers can tell cannot be said."]
    if rows:
        tables.append(Table("How well it is told from the real (d')", ("condition", "d'"), tuple(rows),
                            ("0: not at all; 1: as by 69 % right answers where both are as frequent; of all viewers' "
                             "answers together.",)))
    alpha = krippendorff(judged.grid(len(names), len(sheet.sentences)), nominal=True)
    agreed = agreement_table(alpha, "what is real")
    return Found(scores, "share that was called real", (*tables, agreed), tuple(warnings))


def intelligibility(sheet: Sheet, judged: Judgements) -> Found:
    """What a test of words says."""
    count = int(sheet.design["alternatives"])
    chance = 1 / count if count else 0.0
    scores, tables = _rates(sheet, judged, "told", chance)
    warnings = [] if any(c.shows == "frozen" for c in sheet.conditions) or count else [
        "There is no frozen face: how many words are told without looking is not known."]
    alpha = krippendorff(judged.grid(len(sheet.conditions), len(sheet.sentences)), nominal=True)
    agreed = agreement_table(alpha, "which words can be told")
    return Found(scores, "share of words that were told", (*tables, agreed), tuple(warnings))


def _rates(sheet: Sheet, judged: Judgements, title: str, chance: float) -> tuple[dict[str, Score], list[Table]]:
    """The share of ones of each condition, over viewers and over answers, and the differences between conditions."""
    names, rows, scores = names_of(sheet), list[tuple[str, ...]](), dict[str, Score]()
    for k, name in enumerate(names):
        mask = judged.condition == k
        if not mask.any():
            continue
        over = share_over_viewers(own_means(judged.value[mask], judged.viewer[mask]), chance)
        exact = exact_share(int(judged.value[mask].sum()), int(mask.sum()), chance)
        scores[name] = Score.of(over)
        tested = (p_value(over.p), p_value(exact.p)) if chance else (NONE, NONE)
        rows.append((name, str(int(mask.sum())), interval(over), tested[0], interval(exact), tested[1]))
    by = f"p (of {chance:.3g})" if chance else "p"
    head = ("condition", "answers", "over viewers", by, "over answers, exact", by)
    table = Table(f"Share that was {title}", head, tuple(rows),
                  ("The interval over viewers holds for viewers who were not asked; the exact one takes all answers as "
                   "independent.",))
    means = judged.table(len(names))

    def difference(a: int, b: int) -> Share:
        d = means[:, a] - means[:, b]
        return mean_interval(d[~np.isnan(d)])

    more = [differences(names, difference, "share")] if len(names) > 1 else []
    return scores, [table, *more]
