"""All systems on all metrics: values with intervals, paired tests, phone classes; as text, Markdown and JSON."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.evaluation.anchors import anchors
from dnnvss.evaluation.bench import POINTS, Bench, Measure, Sentence, in_unit
from dnnvss.evaluation.cells import interval, number, number_of, p_value
from dnnvss.evaluation.measures import MEASURES, frame_errors
from dnnvss.evaluation.statistics import (
    FEWEST,
    Difference,
    Estimate,
    differences,
    enough,
    estimate,
    holm,
    pooled,
)
from dnnvss.face.base import APERTURE
from dnnvss.formats.tables import aligned, markdown_numbers
from dnnvss.phones.articulation import ARTICULATION
from dnnvss.systems.registry import INPUTS

CLASSES = ("vowel", "bilabial", "labiodental", "dental", "alveolar", "postalveolar", "velar", "other consonant",
           "silence")

Predictions = Mapping[str, np.ndarray]
TestRow = tuple[str, str, Difference, float]
"""Metric, which systems, their difference, and its corrected p."""
_NOTHING = 0.9995
"""A p that says no more than 1."""


def phone_class(phone: str) -> str:
    """Return the class that a phone is counted in: consonants by place, vowels together."""
    a = ARTICULATION[phone]
    if a.manner in ("vowel", "silence"):
        return a.manner
    return a.place if a.place in CLASSES else "other consonant"


@dataclass(frozen=True)
class Comparison:
    """The harness's result.

    Args:
        pairs: system to metric name to (sentences, 2).
        classes: system to phone class to metric to (sentences, 2).
        sentences: ids.
        systems: names of the systems under test; all others are anchors.
        measures: metrics in order.
        first: number of leading coefficients in averages.
        seed: of intervals and tests.
        unit: of the face.
        lacking: title of a metric that was left out to what the face lacks for it.
        inputs: system to what drives it, text or a voice (:data:`~dnnvss.systems.registry.INPUTS`), where that is
            known.
        origins: system to its run and the style in which that spoke, where a run spoke in several: only systems of one
            style, or of one run, are tested against each other.
        twins: systems that predict the same in every frame.
    """

    pairs: dict[str, dict[str, np.ndarray]]
    classes: dict[str, dict[str, dict[str, np.ndarray]]]
    sentences: tuple[str, ...]
    systems: tuple[str, ...]
    measures: tuple[Measure, ...]
    first: int
    seed: int = 0
    unit: str = "px"
    lacking: Mapping[str, str] = field(default_factory=dict)
    inputs: Mapping[str, str] = field(default_factory=dict)
    origins: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    twins: tuple[tuple[str, ...], ...] = ()

    def estimate(self, system: str, metric: str) -> Estimate:
        """Return a system's value and 95 % interval; without the interval where the sentences are too few for one."""
        found = estimate(self.pairs[system][metric], self.seed)
        return Estimate(found.value, float("nan"), float("nan")) if self.few else found

    @property
    def few(self) -> list[str]:
        """A paragraph where the sentences are too few for an interval or a test; none where they are not."""
        count = len(self.sentences)
        said = f"{number_of(count, 'sentence')} {'is' if count == 1 else 'are'} too few for an interval or a test"
        return [f"{said} to mean anything."] if count < FEWEST else []

    @cached_property
    def tests(self) -> dict[str, list[tuple[str, str, Difference, float]]]:
        """Of each metric the systems that are tested against each other, their difference and its p corrected by Holm's
        method for the number of tests of the metric."""
        asked = [pair for pair in combinations(self.systems, 2) if self._kin(*pair)]
        places = [(self.systems.index(a), self.systems.index(b)) for a, b in asked]
        made = {}
        for m in self.measures:
            found = differences([self.pairs[s][m.name] for s in self.systems], places, self.seed,
                                permutations=enough(len(asked)))
            corrected = holm([d.p for d in found])
            made[m.name] = [(a, b, d, p) for (a, b), d, p in zip(asked, found, corrected, strict=True)]
        return made

    def _kin(self, first: str, second: str) -> bool:
        if first not in self.origins or second not in self.origins:
            return True
        return any(own == other for own, other in zip(self.origins[first], self.origins[second], strict=True))

    def telling(self) -> tuple[list[TestRow], int]:
        """The paired differences that can say something, and how many were left out.

        One whose p is 1 after the correction is no difference that was found; nothing is told of fewer than six
        sentences.
        """
        rows = [(m.title, f"{self.titled(b, a)} less {self.titled(a, b)}", d, p)
                for m in self.measures for a, b, d, p in self.tests[m.name] if not np.isnan(d.value)]
        kept = [row for row in rows if row[3] < _NOTHING] if not self.few else []
        return kept, len(rows) - len(kept)

    @property
    def tested(self) -> list[str]:
        """A paragraph about what the tests are; none where nothing is tested."""
        count = max((len(rows) for rows in self.tests.values()), default=0)
        if self.few or not count:
            return []
        which = "systems of one style, and the styles of one system" if self.origins else "all systems"
        return [f"Compared are {which}. Each p is that of a paired permutation test over the sentences "
                f"({enough(count)} permutations), and is corrected by Holm's method for the {count} of its metric."]

    @property
    def gaps(self) -> list[str]:
        """A paragraph about what was left out because the face lacks something; none where nothing was."""
        missing = ", ".join(f"{title} ({what})" for title, what in self.lacking.items())
        return [f"Left out, with what this kind of face lacks for it in brackets: {missing}."] if missing else []

    def with_inputs(self, inputs: Mapping[str, str],
                    origins: Mapping[str, tuple[str, str]] | None = None) -> "Comparison":
        """The same, with what drives each system, and of which run and style it is; what is driven alike stands
        together."""
        order = {name: INPUTS.index(inputs[name]) if name in inputs else len(INPUTS) for name in self.pairs}
        names = sorted(self.pairs, key=lambda name: order[name])
        return replace(self, pairs={n: self.pairs[n] for n in names}, classes={n: self.classes[n] for n in names},
                       systems=tuple(n for n in names if n in self.systems), inputs=dict(inputs),
                       origins=dict(origins or {}))

    @property
    def same(self) -> list[str]:
        """A paragraph about systems that predict the same; none where no two do."""
        return [f"{' and '.join(names)} predict the same in every frame: what they were told differently makes no "
                "difference to their system." for names in self.twins]

    @property
    def rivals(self) -> list[str]:
        """A paragraph where systems are driven by different things; none where they are not."""
        kinds = [kind for kind in INPUTS if kind in {self.inputs.get(name) for name in self.systems}]
        if len(kinds) < 2:
            return []
        return [f"These systems are driven by different things ({', '.join(kinds)}) and are no ranking of each other: "
                "what goes by text is given the right phones and their times, what goes by a voice is not."]

    def titled(self, system: str, other: str) -> str:
        """A system in a sentence with another: with what drives it, where that differs."""
        own = self.inputs.get(system)
        return system if own == self.inputs.get(other) else f"{system} [{own or 'unknown'}]"

    @property
    def head(self) -> list[str]:
        """The titles of the columns that say which system a row is of."""
        return ["system", "driven by"] if self.inputs else ["system"]

    def named(self, system: str) -> list[str]:
        """The cells under :attr:`head`."""
        return [system, self.inputs.get(system, "")] if self.inputs else [system]

    def markdown(self) -> str:
        """Return the report in Markdown: values, tests, phone classes, definitions."""
        parts = [f"{number_of(len(self.sentences), 'sentence')}; averages run over the first {self.first} "
                 "coefficients. In brackets the 95 % bootstrap interval over sentences."]
        parts += self.gaps + self.rivals + self.same + self.few
        for block in _split(self.measures, 5):
            rows = [[*self.named(s), *[interval(self.estimate(s, m.name)) for m in block]] for s in self.pairs]
            parts.append(markdown_numbers([*self.head, *[m.title for m in block]], rows))
        if len(self.systems) > 1:
            parts += ["### Paired differences", self._tests_text()]
        parts += ["### By phone class", *self._class_tables(), "### Definitions"]
        parts.append("\n".join(f"- **{m.title}** ({BETTER[m.better]}): {m.definition}" for m in self.measures))
        return "\n\n".join(parts) + "\n"

    def _tests_text(self) -> str:
        kept, without = self.telling()
        rows = [[title, names, interval(Estimate(d.value, d.low, d.high)), p_value(d.p), p_value(p)]
                for title, names, d, p in kept]
        head = ["metric", "systems", "difference", "p (permutation)", "p (Holm)"]
        return "\n\n".join([*self.tested, *([markdown_numbers(head, rows)] if rows else []), *left_out(without)])

    def _class_tables(self) -> list[str]:
        tables = []
        for name, title in CLASS_METRICS.items():
            if any(name in metrics for metrics in next(iter(self.classes.values())).values()):
                rows = [[s, *[number(pooled(by[c][name])) if c in by else number(float("nan")) for c in CLASSES]]
                        for s, by in self.classes.items()]
                tables.append(markdown_numbers([in_unit(title, self.unit), *CLASSES], rows))
        return tables

    def table(self) -> str:
        """Return the values as aligned text for the screen."""
        lines = []
        for block in _split(self.measures, 6):
            rows = [[*self.named(s), *[number(pooled(self.pairs[s][m.name])) for m in block]] for s in self.pairs]
            lines += [aligned(["", *self.head[1:], *[m.title for m in block]], rows), ""]
        return "\n".join([*lines, *self.same]).rstrip()

    def to_json(self) -> dict[str, Any]:
        """Return plain containers: values, intervals, pairs of each sentence, tests, classes, definitions; NaN is
        None."""
        values = {s: {m.name: _plain(self.estimate(s, m.name).__dict__) for m in self.measures} for s in self.pairs}
        raw = {s: {name: np.round(pairs, 6).tolist() for name, pairs in metrics.items()}
               for s, metrics in self.pairs.items()}
        tests = {m.name: [{"first": a, "second": b, **_plain(d.__dict__), **_plain({"holm": p})}
                          for a, b, d, p in self.tests[m.name]] for m in self.measures}
        by_class = {s: {c: _plain({n: pooled(v) for n, v in metrics.items()}) for c, metrics in by.items()}
                    for s, by in self.classes.items()}
        about = {m.name: {"title": m.title, "definition": m.definition, "better": m.better} for m in self.measures}
        return {"sentences": list(self.sentences), "systems": list(self.systems),
                "driven_by": dict(self.inputs), "first": self.first, "metrics": about,
                "values": values, "pairs": raw, "tests": tests, "phone_classes": by_class}


BETTER = {"high": "higher is better", "low": "lower is better", "zero": "best at 0", "one": "best at 1",
           "talker": "best at the truth's value"}
CLASS_METRICS = {"rmse": "RMSE (sd)", "landmarks": "landmarks (UNIT)", "aperture": "aperture error (UNIT)"}
"""Metrics of single frames, by phone class: error of the first coefficients in their standard deviations, mean
distance of the landmarks, and mean aperture of the prediction less that of the truth."""


def left_out(count: int) -> list[str]:
    """A sentence about differences that say nothing; none where there are none."""
    return [f"{count} differences are left out that may well be chance (p = 1 after correction)."] if count else []


def compare(
    bench: Bench, systems: Mapping[str, Predictions], seed: int = 0, with_anchors: bool = True,
    measures: tuple[Measure, ...] = MEASURES,
) -> Comparison:
    """Return the metrics of all systems, the null anchors after them.

    Args:
        bench: the sentences.
        systems: name to sentence id to trajectory (T, D).
        seed: of anchors, intervals and tests.
        with_anchors: whether to add :func:`dnnvss.evaluation.anchors.anchors`.
        measures: the metrics; those that need what the face lacks are left out.

    Raises:
        DnnvssError: nothing to compare, or a prediction that is missing, of another size or not finite.
    """
    if not bench.sentences or not systems:
        raise DnnvssError("there is nothing to compare", remedy="Give one run and one test sentence at least")
    checked = {name: {s.id: _checked(name, own, s) for s in bench.sentences} for name, own in systems.items()}
    extra = {name: p for name, p in anchors(bench, seed).items() if name not in checked} if with_anchors else {}
    lacking, measures = bench.lacks(measures), bench.measured(measures)
    pairs, classes = {}, {}
    for name, predicted in {**checked, **extra}.items():
        rows = {m.name: [m.pair(bench, s, predicted[s.id]) for s in bench.sentences] for m in measures}
        pairs[name] = {metric: np.array(values, dtype=float) for metric, values in rows.items()}
        classes[name] = _by_class(bench, predicted)
    return Comparison(pairs, classes, tuple(s.id for s in bench.sentences), tuple(checked), measures, bench.first, seed,
                      bench.unit, lacking, twins=_twins(checked))


def _twins(systems: Mapping[str, Predictions]) -> tuple[tuple[str, ...], ...]:
    """The names of systems that predict the same, a group each."""
    groups: list[list[str]] = []
    for name, own in systems.items():
        alike = (g for g in groups if all(np.array_equal(x, systems[g[0]][i]) for i, x in own.items()))
        if (group := next(alike, None)) is not None:
            group.append(name)
        else:
            groups.append([name])
    return tuple(tuple(group) for group in groups if len(group) > 1)


def _checked(name: str, predicted: Predictions, s: Sentence) -> np.ndarray:
    if s.id not in predicted:
        raise DnnvssError(f"system {name!r} has no prediction", utterance=s.id, remedy="Predict every test sentence")
    x = np.asarray(predicted[s.id], dtype=float)
    if x.shape != s.reference.shape or not np.isfinite(x).all():
        raise DnnvssError(f"system {name!r} predicts {x.shape} where {s.reference.shape} was measured, or not finite",
                          utterance=s.id, remedy="Predict every frame on the clock of the reference")
    return x


def _by_class(bench: Bench, predicted: Predictions) -> dict[str, dict[str, np.ndarray]]:
    """Return phone class to metric to (sentences, 2): sums over the frames of the class, and their number."""
    found: dict[str, dict[str, list[tuple[float, float]]]] = {}
    for s in bench.sentences:
        x, owner = predicted[s.id], _frame_classes(s, bench)
        error = ((x - s.reference)[:, : bench.first] / bench.scale[: bench.first]) ** 2
        tracks = {"rmse": error.mean(axis=1)}
        if POINTS in bench.known:
            tracks["landmarks"] = frame_errors(bench, s, x)
        if APERTURE in bench.known:
            tracks["aperture"] = bench.gauge(APERTURE)(x) - bench.gauge(APERTURE)(s.reference)
        for c, name in enumerate(CLASSES):
            mask = (owner == c) & s.valid
            for metric, track in tracks.items():
                pair = float(track[mask].sum()), float(mask.sum())
                found.setdefault(name, {}).setdefault(metric, []).append(pair)
    arrays = {c: {m: np.array(v) for m, v in metrics.items()} for c, metrics in found.items()}
    for metrics in arrays.values():
        metrics["rmse"] = _rooted(metrics["rmse"])
    return arrays


def _rooted(pairs: np.ndarray) -> np.ndarray:
    """Return pairs whose pooled value is the root of the pooled value."""
    mean = pooled(pairs)
    return pairs if not mean > 0 else pairs * np.array([1 / np.sqrt(mean), 1.0])


def _frame_classes(s: Sentence, bench: Bench) -> np.ndarray:
    index = s.tier.frame_index(bench.clock)
    owner = np.array([CLASSES.index(phone_class(label)) for label in s.tier.labels])[index]
    padded = np.full(len(s.reference), owner[-1])
    padded[: len(owner)] = owner[: len(padded)]
    return padded


def _split(measures: tuple[Measure, ...], size: int) -> list[tuple[Measure, ...]]:
    return [measures[i : i + size] for i in range(0, len(measures), size)]


def _plain(values: Mapping[str, float]) -> dict[str, float | None]:
    return {k: None if np.isnan(v) else round(float(v), 6) for k, v in values.items()}
