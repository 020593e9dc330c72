"""From answers to what may be concluded: who counts, which tests fit the design, and what the design does not allow."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.evaluation.viewing.answers import Answer, Received
from dnnvss.evaluation.viewing.choices import intelligibility, turing
from dnnvss.evaluation.viewing.judgements import Judgements, failed_checks, judgements
from dnnvss.evaluation.viewing.preferences import preference
from dnnvss.evaluation.viewing.ratings import dscqs, single
from dnnvss.evaluation.viewing.screening import screened
from dnnvss.evaluation.viewing.sheet import Sheet
from dnnvss.evaluation.viewing.tables import Found, Score, Table

FEWEST = 6
"""Viewers below whom no test over viewers comes below p = .05."""
ADVISED = 15
"""Viewers that ITU-R BT.500 asks for at least."""
_KINDS: dict[str, Callable[[Sheet, Judgements], Found]] = {
    "preference": preference, "single": single, "dscqs": dscqs, "turing": turing, "intelligibility": intelligibility}


@dataclass(frozen=True)
class Analysis:
    """What comes of a test.

    Args:
        sheet: of the test.
        received: what was sent.
        kept: names of the answers that count.
        left_out: why others do not, by name.
        scores: of the conditions by name.
        unit: of the scores, in words.
        tables: to be shown in this order.
        warnings: what the design or the answers do not allow to be claimed.
    """

    sheet: Sheet
    received: Received
    kept: tuple[str, ...]
    left_out: Mapping[str, str]
    scores: Mapping[str, Score]
    unit: str
    tables: tuple[Table, ...]
    warnings: tuple[str, ...] = field(default=())


def analyse(sheet: Sheet, received: Received) -> Analysis:
    """Everything that the design allows to be said of some answers.

    Raises:
        DnnvssError: no answer counts.
    """
    judged = judgements(sheet, received.answers)
    left_out = _left_out(sheet, received.answers, judged)
    kept = [name for name in received.answers if name not in left_out]
    if not kept:
        raise DnnvssError("no answer counts: "
                          + (next(iter({**received.refused, **left_out}.values()), "none was sent")),
                          remedy="See what was refused, and ask viewers")
    found = _KINDS[sheet.design["kind"]](sheet, judged.of(kept))
    warnings = (*_warnings(sheet, len(kept)), *_apart(sheet, [received.answers[name] for name in kept]),
                *_alike(found, len(kept)), *found.warnings)
    return Analysis(sheet, received, tuple(kept), left_out, found.scores, found.unit, found.tables, warnings)


def _left_out(sheet: Sheet, answers: Mapping[str, Answer], judged: Judgements) -> dict[str, str]:
    """Viewers who failed half of the attention checks or more, and those whom BT.500 screens out."""
    left = {}
    for name, answer in answers.items():
        failed, checks = failed_checks(sheet, answer)
        if checks and 2 * failed >= checks:
            left[name] = f"failed {failed} of {checks} attention checks"
    if sheet.design["kind"] in ("single", "dscqs"):
        kept = judged.of([name for name in answers if name not in left])
        if kept.viewers:
            grid = kept.single().grid(len(sheet.conditions), len(sheet.sentences))
            for name, out in zip(kept.viewers, screened(grid), strict=True):
                if out:
                    left[name] = "screened out after ITU-R BT.500"
    return left


def _apart(sheet: Sheet, answers: Sequence[Answer]) -> list[str]:
    """What is said of pairs that did not begin together, whatever the page tried."""
    frame = {s.id: 1000 / s.rate for s in sheet.stimuli}
    late = [abs(row.apart) > frame[row.stimuli[0].id] for answer in answers for row in answer.rows
            if row.apart is not None]
    return [f"{sum(late)} of {len(late)} pairs began more than a picture apart (apart, in the answers)."] * any(late)


def _alike(found: Found, viewers: int) -> list[str]:
    """What is said of conditions of which viewers do not say how far others would differ."""
    names = [name for name, score in found.scores.items() if np.isnan(score.low)]
    if viewers < 2 or not names:
        return []
    return [f"No interval for {', '.join(names)}: only one viewer saw it, or all who did gave the same."]


def _warnings(sheet: Sheet, viewers: int) -> list[str]:
    said = []
    if viewers < FEWEST:
        said.append(f"{viewers} viewer{' is' if viewers == 1 else 's are'} too few for any test over viewers: nothing "
                    "here holds for others.")
    elif viewers < ADVISED:
        said.append(f"{viewers} viewers: ITU-R BT.500 asks for {ADVISED} at least.")
    if not sheet.design["checks"]:
        said.append("The design has no attention checks: careless viewers are not found.")
    if sheet.design["sentences"] < 10:
        said.append(f"{sheet.design['sentences']} sentences: what holds for them may not hold for others.")
    if sheet.design["kind"] in ("preference", "turing") and sheet.design["sound"] == "silent":
        said.append("There was no sound: nothing is said about how well lips and sound fit together.")
    return said
