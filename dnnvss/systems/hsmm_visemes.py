"""Hidden semi-Markov models of dynamic visemes: so many units are worth what movement they give back."""

from collections.abc import Sequence
from functools import cache

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.features import FeatureTable, FrameCodes, visemes_of
from dnnvss.systems.base import Example
from dnnvss.systems.hsmm import HiddenSemiMarkov, HiddenSemiMarkovSettings
from dnnvss.timing import FrameClock

_WHICH = ("second unit before", "unit before", "unit", "unit after", "second unit after")
_REACH = len(_WHICH) // 2
_PHONES = (0, 1, 2, 3, 4)


@cache
def unit_questions(units: int) -> tuple[str, ...]:
    """The questions in words, in the order of the columns of :func:`unit_answers`.

    For each of five units, whether it is the unit u and whether it lies outside the utterance; then how many phones the
    unit holds.
    """
    asked = [f"{which}: Is it {'outside the utterance' if u == units else u}?"
             for which in _WHICH for u in range(units + 1)]
    return (*asked, *(f"phones: At most {limit}?" for limit in _PHONES))


def unit_answers(code: np.ndarray, phones: np.ndarray, units: int) -> np.ndarray:
    """Yes or no (S, Q), bool, of the units (S,) of one utterance, which hold ``phones`` (S,), to each question."""
    padded = np.pad(code, _REACH, constant_values=units)
    around = [padded[k : k + len(code), None] == np.arange(units + 1) for k in range(len(_WHICH))]
    return np.concatenate([*around, phones[:, None] <= np.array(_PHONES)], 1)


class VisemeHiddenSemiMarkov(HiddenSemiMarkov):
    """Five left-to-right states a dynamic viseme, as :class:`HiddenSemiMarkov` has them a phone.

    Every tree asks first which unit it is, then for its neighbours where that is worth it.

    **Source**: Thangthai et al. 2016, section 3, who chose the number of units by such synthesis.

    Args:
        table: the feature table of the labels, with dynamic visemes.
        clock: the trajectory clock.
        settings: see :class:`HiddenSemiMarkovSettings`.

    Raises:
        DnnvssError: the labels have no dynamic visemes.
    """

    system = "hsmm_visemes"
    reads = frozenset({"phones", "words", "visemes"})
    looks_up = frozenset({"visemes"})

    def __init__(self, table: FeatureTable, clock: FrameClock,
                 settings: HiddenSemiMarkovSettings | None = None) -> None:
        super().__init__(table, clock, settings)
        if "visemes" not in table.sources:
            raise DnnvssError(f"model=hsmm_visemes is made of dynamic visemes, and {table.title} has none",
                              remedy="Train it with labels=dv, or take model=hsmm")

    def phone_durations(self, example: Example) -> None:
        """None: the durations are those of dynamic visemes."""
        del example

    def lengths(self, codes: FrameCodes) -> np.ndarray:
        """The frames (S,) of the dynamic visemes."""
        return visemes_of(codes).frames

    def answers(self, codes: FrameCodes) -> np.ndarray:
        """Their answers (S, Q) to :meth:`questions`."""
        own = visemes_of(codes)
        return unit_answers(own.code, own.phones, self.table.settings.units)

    def questions(self) -> tuple[str, ...]:
        """What trees may ask of a unit, in words."""
        return unit_questions(self.table.settings.units)

    def asked_first(self) -> Sequence[int]:
        """Which unit it is."""
        units = self.table.settings.units
        return range(_REACH * (units + 1), _REACH * (units + 1) + units)
