"""What a finished run was worth: its correlation on the test split, and that by which runs are chosen."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.settings import shown

_REMEDY = "Train the run anew: overwrite=true"


@dataclass(frozen=True)
class Headlines:
    """Correlations over speech of the first coefficients, by plain MLPG.

    Args:
        test: on the test split; NaN where nothing moves in it.
        validation: on the validation split, or on all sentences where they were left out in turn, in place of a test
            split. NaN where nothing moves in them, and of runs of before, which do not keep it.
        sentences: the ids of these sentences; none of runs of before.
    """

    test: float
    validation: float = math.nan
    sentences: tuple[str, ...] = ()


def read_headlines(metrics: Path) -> Headlines:
    """What ``metrics.json`` of a finished run says.

    Raises:
        DnnvssError: it is missing or damaged.
    """
    value = files.read_json(metrics, _REMEDY)
    if not isinstance(value, Mapping) or "headline" not in value:
        raise DnnvssError("headline is missing", file=metrics, remedy=_REMEDY)
    test = _number(value["headline"], "headline", metrics)
    if (chosen := value.get("validation")) is None:
        return Headlines(test)
    sentences = chosen.get("sentences") if isinstance(chosen, Mapping) else None
    if not isinstance(sentences, list) or "headline" not in chosen:
        raise DnnvssError(f"validation is {shown(chosen)}", file=metrics, remedy=_REMEDY)
    return Headlines(test, _number(chosen["headline"], "validation.headline", metrics),
                     tuple(sorted(map(str, sentences))))


def _number(value: Any, name: str, metrics: Path) -> float:
    """A number, NaN for None, which stands for it in files."""
    if value is None:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 2**63:
        raise DnnvssError(f"{name} is {shown(value)}", file=metrics, remedy=_REMEDY)
    return float(value)
