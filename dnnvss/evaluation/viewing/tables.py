"""What an analysis shows: tables, and scores with intervals."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from dnnvss.evaluation.cells import interval, number, p_value
from dnnvss.evaluation.statistics import holm
from dnnvss.evaluation.viewing.shares import Share
from dnnvss.evaluation.viewing.sheet import Sheet


@dataclass(frozen=True)
class Table:
    """A table: title, heads of the columns, rows of cells, and what has to be said about it."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Score:
    """What viewers gave a condition, with its 95 % interval over viewers; NaN where they are too few or all alike."""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, share: Share) -> "Score":
        """The score that a share or mean over viewers is."""
        return cls(share.value, share.low, share.high)


@dataclass(frozen=True)
class Found:
    """What the tests of one kind of design give."""

    scores: Mapping[str, Score]
    unit: str
    tables: tuple[Table, ...]
    warnings: tuple[str, ...] = ()


def names_of(sheet: Sheet) -> list[str]:
    """The names of the conditions."""
    return [c.name for c in sheet.conditions]


def differences(names: Sequence[str], difference: Callable[[int, int], Share], title: str,
                digits: int | None = None) -> Table:
    """All differences of two conditions with their corrected p."""
    pairs = list(combinations(range(len(names)), 2))
    found = [difference(a, b) for a, b in pairs]
    rows = tuple((names[a], names[b], interval(f, digits), p_value(f.p), p_value(p))
                 for (a, b), f, p in zip(pairs, found, holm([f.p for f in found]), strict=True))
    return Table(f"Differences in {title}", ("first", "second", "first less second", "p", "p (Holm)"), rows)


def own_means(values: np.ndarray, viewer: np.ndarray) -> np.ndarray:
    """The mean of each viewer's own values (V,), of all values (N,) and who gave them (N,)."""
    return np.array([values[viewer == v].mean() for v in np.unique(viewer)])


def over_viewers(values: np.ndarray, viewer: np.ndarray, of: Callable[[np.ndarray], Share]) -> Score:
    """The mean of viewers' own means with its interval."""
    return Score.of(of(own_means(values, viewer)))


def agreement_table(alpha: float, about: str,
                    nothing: str = "the same answers dealt out at random, however many of them are alike") -> Table:
    """The table of how far viewers agree about something, and what is no agreement."""
    return Table("Agreement of viewers", ("Krippendorff's alpha",), ((number(alpha),),),
                 (f"About {about}: 1 is one mind, 0 is {nothing}.",))
