"""What systems are measured on: sentences, the clock, the face, and what a metric is."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dnnvss.evaluation.lips import talker_level
from dnnvss.face.base import APERTURE, LOWER_LIP, WIDTH, Face, Gauge
from dnnvss.phones import BILABIALS, LABIODENTALS, SILENCES
from dnnvss.timing import FrameClock, Tier

STILL_MARGIN = 0.1
"""Seconds of silence beside speech that do not count as silence: the mouth opens and closes there."""
POINTS = "points"
"""What a metric of landmarks needs of a face."""

Pair = tuple[float, float]
PairFunction = Callable[["Bench", "Sentence", np.ndarray], Pair]


@dataclass(frozen=True)
class Sentence:
    """A measured sentence.

    Args:
        id: of the utterance.
        reference: parameters (T, D).
        tier: the phones tier; its start is frame 0.
        speech, valid: (T,) bool, from the first phone's start to the last one's end; frames that were measured.
        landmarks: tracked points (T, P, 2 or 3) in the unit of the face, or None: then those of the reference
            parameters count.
    """

    id: str
    reference: np.ndarray
    tier: Tier
    speech: np.ndarray
    valid: np.ndarray
    landmarks: np.ndarray | None = None

    @property
    def whole(self) -> bool:
        """Whether every frame of speech was measured: what looks at movement over time needs that."""
        return bool(self.valid[self.speech].all())

    @property
    def spoken(self) -> np.ndarray:
        """Frames (T,) of speech that were measured."""
        return self.speech & self.valid

    def still(self, clock: FrameClock) -> np.ndarray:
        """Return the frames (T,) of silence that are farther than the margin from speech."""
        mask = np.zeros(len(self.reference), bool)
        for segment in self.tier:
            if segment.label in SILENCES:
                first = segment.start + (STILL_MARGIN if segment.start > self.tier.start else 0.0)
                last = segment.end - (STILL_MARGIN if segment.end < self.tier.end else 0.0)
                if last > first:
                    a, b = clock.edges(np.array([first, last]) - self.tier.start)
                    mask[a:b] = True
        return mask & self.valid


@dataclass(frozen=True)
class Bench:
    """What all systems are measured against: sentences, clock, face, and levels taken from the sentences themselves.

    Args:
        sentences: the test sentences.
        clock: of all trajectories.
        face: landmarks and gauges of parameters, or None: metrics that need what it lacks are left out.
        first: number of leading coefficients in averages.
    """

    sentences: tuple[Sentence, ...]
    clock: FrameClock
    face: Face | None = None
    first: int = 5

    @cached_property
    def scale(self) -> np.ndarray:
        """The standard deviation (D,) of each coefficient over the measured frames of all sentences."""
        deviation = np.concatenate([s.reference[s.valid] for s in self.sentences]).std(axis=0)
        return np.where(deviation > 0, deviation, 1.0)

    @cached_property
    def closed(self) -> float:
        """The aperture that 95 % of the talker's own p, b and m reach, in the unit of the face."""
        return self._level(self.gauge(APERTURE), BILABIALS)

    @cached_property
    def contact(self) -> float:
        """The place of the lower lip that 95 % of the talker's own f and v reach, in the unit of the face."""
        return self._level(self.gauge(LOWER_LIP), LABIODENTALS)

    @cached_property
    def mouth(self) -> float:
        """The talker's mean mouth width in the unit of the face."""
        width = self.gauge(WIDTH)
        return float(np.mean(np.concatenate([width(s.reference[s.spoken]) for s in self.sentences])))

    @cached_property
    def known(self) -> frozenset[str]:
        """What metrics may need: the names of the face's gauges, and ``points`` where it has any."""
        if self.face is None:
            return frozenset()
        return frozenset(self.face.gauges) | ({POINTS} if self.face.jacobian().shape[1] else set())

    @property
    def unit(self) -> str:
        """Of the face; pixels where there is none."""
        return "px" if self.face is None else self.face.unit

    def gauge(self, name: str) -> Gauge:
        """A gauge of the face by its name; whoever asks has looked at :attr:`known`."""
        assert self.face is not None
        return self.face.gauges[name]

    def lacks(self, measures: Sequence["Measure"]) -> dict[str, str]:
        """Title of each metric that this face cannot be measured by, to what the face lacks."""
        return {m.in_unit(self.unit).title: ", ".join(sorted(set(m.needs) - self.known))
                for m in measures if not self.known.issuperset(m.needs)}

    def measured(self, measures: Sequence["Measure"]) -> tuple["Measure", ...]:
        """Those of some metrics that this face can be measured by, in its unit."""
        return tuple(m.in_unit(self.unit) for m in measures if self.known.issuperset(m.needs))

    def _level(self, gauge: Gauge, phones: tuple[str, ...]) -> float:
        tracks = [gauge(s.reference) for s in self.sentences]
        tiers, valid = [s.tier for s in self.sentences], [s.valid for s in self.sentences]
        return talker_level(tracks, tiers, self.clock, phones, valid=valid)


def leading(face: Face | None, first: int = 5) -> int:
    """Over how many leading coefficients averages run: all of a face without points, whose curves have no order."""
    return first if face is None or face.jacobian().shape[1] else len(face.names)


@dataclass(frozen=True)
class Measure:
    """A metric.

    Args:
        name: key in files.
        title: heading of its column, with the unit; ``UNIT`` stands for that of the face.
        definition: what it is, in words, with every number in it; ``UNITS`` stands for the face's unit in full.
        pair: sentence and prediction (T, D) to (amount, weight); see :mod:`dnnvss.evaluation.statistics`.
        better: ``high``, ``low``, ``zero``, ``one`` or ``talker`` (as near as possible to the row of the truth).
        needs: gauges of the face by name, or ``points``.
    """

    name: str
    title: str
    definition: str
    pair: PairFunction
    better: str
    needs: tuple[str, ...] = ()

    def in_unit(self, unit: str) -> "Measure":
        """The metric with the unit of a face in its title and definition."""
        return replace(self, title=in_unit(self.title, unit), definition=in_unit(self.definition, unit))


def in_unit(text: str, unit: str) -> str:
    """A text in which ``UNITS`` and ``UNIT`` have become the unit of a face in full and in short."""
    return text.replace("UNITS", {"px": "pixels"}.get(unit, unit)).replace("UNIT", unit)
