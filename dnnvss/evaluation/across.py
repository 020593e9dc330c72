"""Runs of different faces in one table: compared by the gauges that their faces share."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar, Self

import numpy as np

from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.bench import POINTS, Bench, Measure, Pair, PairFunction, Sentence
from dnnvss.evaluation.comparison import Comparison, Predictions, compare
from dnnvss.evaluation.measures import MEASURES
from dnnvss.evaluation.metrics import correlation
from dnnvss.face.base import APERTURE, LOWER_LIP, WIDTH, Gauge, name_groups

OWN = (" Each system's is that of its own face's coefficients: compare it between systems of one face only; those of "
       "the gauges can be compared between all.")


@dataclass(frozen=True)
class GaugeFace:
    """A face whose parameters are the gauges of another: what faces of any kind have in common.

    Args:
        names: of the gauges.
        deviations: standard deviation of each.
        unit: of the gauges.
    """

    kind: ClassVar[str] = "gauges"

    names: tuple[str, ...]
    deviations: np.ndarray
    unit: str = "px"

    @property
    def groups(self) -> Mapping[str, tuple[int, ...]]:
        """Each gauge by itself."""
        return name_groups(self.names)

    @property
    def gauges(self) -> Mapping[str, Gauge]:
        """The parameters themselves."""
        rows = np.eye(len(self.names))
        return {name: Gauge(name, row, 0.0, self.unit) for name, row in zip(self.names, rows, strict=True)}

    @property
    def contours(self) -> Mapping[str, Sequence[int]]:
        """No lines."""
        return {}

    def points(self, parameters: np.ndarray) -> np.ndarray:
        """No points, (..., 0, 2)."""
        return np.zeros((*np.shape(parameters)[:-1], 0, 2))

    def jacobian(self) -> np.ndarray:
        """No points, (D, 0, 2)."""
        return np.zeros((len(self.names), 0, 2))

    def save(self, path: Path) -> Path:
        """Write names, deviations and unit, and return the path."""
        return files.write_arrays(path, kind=np.array(self.kind), names=np.array(self.names),
                                  deviations=self.deviations, unit=np.array(self.unit))

    @classmethod
    def load(cls, path: Path) -> Self:
        """The face that :meth:`save` wrote."""
        arrays = read_arrays(path)
        return cls(tuple(map(str, arrays["names"])), arrays["deviations"], str(arrays["unit"]))


@dataclass(frozen=True)
class Side:
    """Systems of one face.

    Args:
        bench: the sentences as this face measures them.
        systems: name to sentence id to trajectory (T, D) of this face.
    """

    bench: Bench
    systems: Mapping[str, Predictions]

    def gauged(self, names: Sequence[str]) -> "Side":
        """The same systems as gauges, in the order of ``names``."""
        face = self.bench.face
        assert face is not None

        def measured(x: np.ndarray) -> np.ndarray:
            return np.stack([face.gauges[name](np.asarray(x, dtype=float)) for name in names], axis=-1)

        sentences = tuple(replace(s, reference=measured(s.reference), landmarks=None) for s in self.bench.sentences)
        spread = np.concatenate([s.reference[s.valid] for s in sentences]).std(axis=0)
        bench = Bench(sentences, self.bench.clock, GaugeFace(tuple(names), spread, face.unit), len(names))
        return Side(bench, {system: {i: measured(x) for i, x in own.items()} for system, own in self.systems.items()})


def shared_gauges(sides: Mapping[str, Side]) -> tuple[str, ...]:
    """The gauges that all faces have.

    Raises:
        DnnvssError: they have none in common, or in different units.
    """
    faces = {name: side.bench.face for name, side in sides.items()}
    known = [set() if face is None else set(face.gauges) for face in faces.values()]
    names = tuple(name for name in (APERTURE, LOWER_LIP, WIDTH) if all(name in own for own in known))
    units = {face.unit for face in faces.values() if face is not None}
    if not names or len(units) > 1:
        what = f"measure in {' and '.join(sorted(units))}" if names else "share no gauge"
        raise DnnvssError(f"the faces {', '.join(sides)} {what}, so their runs cannot be compared",
                          remedy="Compare runs of one face")
    return names


def compare_faces(sides: Mapping[str, Side], seed: int = 0) -> tuple[Comparison, Side]:
    """Systems of different faces on what the faces share, each against the truth as its own face measures it.

    Args:
        sides: name of a face, as the anchors of its truth are called, to its systems.
        seed: of anchors, intervals and tests.

    Returns:
        The comparison, and all systems as gauges on the bench of the first face, to be shown.
    """
    names = shared_gauges(sides)
    known = [m for m in MEASURES if POINTS not in m.needs and (m.needs or m.name == "correlation")]
    measures = tuple(m for m in known if set(m.needs) <= set(names))
    measures = tuple(replace(m, title="correlation, own", definition=m.definition + OWN) if m.name == "correlation"
                     else m for m in measures)
    wanted = (measures[0], *[_followed(name) for name in names], *measures[1:])
    parts = {face: compare(side.bench, side.systems, seed, measures=wanted) for face, side in sides.items()}
    tested = [system for part in parts.values() for system in part.systems]
    labels = {(face, system): system if system in part.systems else f"{system} ({face})"
              for face, part in parts.items() for system in part.pairs}
    order = sorted(labels, key=lambda key: labels[key] not in tested)
    pairs = {labels[face, system]: parts[face].pairs[system] for face, system in order}
    classes = {labels[face, system]: {phone: {m: v for m, v in own.items() if m == APERTURE}
                                      for phone, own in parts[face].classes[system].items()} for face, system in order}
    first = next(iter(parts.values()))
    lacking = {m.in_unit(first.unit).title: ", ".join(sorted(set(m.needs) - set(names)))
               for m in known if not set(m.needs) <= set(names)}
    twins = tuple(group for part in parts.values() for group in part.twins)
    result = replace(first, pairs=pairs, classes=classes, systems=tuple(tested), lacking=lacking, twins=twins)
    gauged = {face: side.gauged(names) for face, side in sides.items()}
    shown = Side(next(iter(gauged.values())).bench, {n: x for side in gauged.values() for n, x in side.systems.items()})
    return result, shown


def _followed(name: str) -> Measure:
    """How well a gauge follows that of the truth."""
    pair: PairFunction = lambda bench, s, x: _correlated(bench, s, x, name)  # noqa: E731
    title = name.replace("_", " ")
    return Measure(f"{name}_correlation", f"{title} r",
                   f"Pearson's correlation of the {title} over the measured frames from the first phone's start to the "
                   "last one's end, averaged over the sentences.", pair, "high", (name,))


def _correlated(bench: Bench, s: Sentence, x: np.ndarray, name: str) -> Pair:
    gauge = bench.gauge(name)
    value = float(correlation(gauge(s.reference[s.spoken])[:, None], gauge(x[s.spoken])[:, None])[0])
    return (0.0, 0.0) if np.isnan(value) else (value, 1.0)
