"""How well dynamic visemes are predicted, for the page of results."""

from collections.abc import Sequence
from typing import Any

from dnnvss.runs.corpus_visemes import CorpusUnits
from dnnvss.systems.base import Example
from dnnvss.systems.viseme_plan import SOURCES, UnitPlan
from dnnvss.visemes import unit_scores


def unit_notes(units: CorpusUnits, plan: UnitPlan, test: Sequence[Example]) -> tuple[list[str], dict[str, Any]]:
    """Return what the page of results has to say about units, and the numbers in it.

    The first note tells whence the units are that the sentences were tested with. The second tells how well those that
    are predicted from text agree with those cut from the video, whichever were used.
    """
    clock, predictor = units.model.predictor.clock, units.model.predictor
    pairs = [(predictor.tier(e.codes, e.alignment), units.oracle[e.id]) for e in test]
    s = unit_scores(pairs, clock)
    agreement = {"frames": s.frames, "moving": s.moving, "sequence": s.sequence, "error": s.error,
                 "f1": {str(n): value for n, value in s.f1.items()}}
    numbers = {"source": plan.source, "training": plan.training, "samples": plan.samples,
               "units": len(units.model.visemes), "predicted": agreement}
    f1 = ", ".join(f"{value:.3f} within {n} frames" for n, value in s.f1.items())
    text = (f"{len(units.model.visemes)} dynamic visemes, learnt from {plan.training} units. Those predicted from "
            f"text, against those cut from the test video: right in {s.frames:.3f} of all frames and {s.moving:.3f} of "
            f"those in which the face moves, sequence accuracy {s.sequence:.3f}, boundary F1 {f1} of {clock} a second, "
            f"boundary error {s.error:.1f} ms.")
    return [SOURCES[plan.source], text], numbers
