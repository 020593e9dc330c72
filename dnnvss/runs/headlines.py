"""What a finished run was worth: its correlation on the test split, and that by which runs are chosen."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.records import as_record
from dnnvss.settings import setting, shown

_REMEDY = "Train the run anew: overwrite=true"


@dataclass(frozen=True)
class Validation:
    """What is known without the test split, by which runs are chosen.

    Args:
        headline: the correlation over speech of the first coefficients, by plain MLPG, on the validation split, or on
            all sentences where they were left out in turn, in place of a test split. None where nothing moves in them.
        sentences: the ids of the sentences that it is of.
    """

    headline: float | None = setting()
    sentences: tuple[str, ...] = setting()


@dataclass(frozen=True)
class Headlines:
    """What a run was worth.

    Args:
        test: the correlation on the test split; NaN where nothing moves in it.
        known: without the test split; None of runs of before, which do not keep it.
    """

    test: float
    known: Validation | None = None

    @property
    def validation(self) -> float:
        """The correlation by which runs are chosen, NaN where there is none."""
        told = None if self.known is None else self.known.headline
        return math.nan if told is None else told

    @property
    def sentences(self) -> tuple[str, ...]:
        """The ids of the sentences that :attr:`validation` is of, sorted."""
        return () if self.known is None else tuple(sorted(self.known.sentences))


def read_headlines(metrics: Path) -> Headlines:
    """What ``metrics.json`` of a finished run says.

    Raises:
        DnnvssError: it is missing or damaged.
    """
    value = files.read_json(metrics, _REMEDY)
    if not isinstance(value, Mapping) or "headline" not in value:
        raise DnnvssError("headline is missing", file=metrics, remedy=_REMEDY)
    test, known = value["headline"], value.get("validation")
    if isinstance(test, bool) or not isinstance(test, int | float | None) or abs(test or 0) >= 2**63:
        raise DnnvssError(f"headline is {shown(test)}", file=metrics, remedy=_REMEDY)
    return Headlines(math.nan if test is None else float(test),
                     None if known is None else as_record(Validation, known, metrics, _REMEDY, "validation"))
