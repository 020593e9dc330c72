"""Scores of systems over sentences, and the tables made from them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.evaluation.cells import number, number_of
from dnnvss.evaluation.metrics import METRICS, mean_known
from dnnvss.formats.tables import aligned, markdown_numbers

REGIONS = ("speech", "all")
"""``speech``: from the start of the first phone to the end of the last; ``all``: every frame. Invalid frames never
count."""

TITLES = {"correlation": "correlation", "rmse": "RMSE", "centred_rmse": "centred RMSE", "gv_ratio": "GV ratio"}

Scores = dict[str, dict[str, np.ndarray]]
"""Region to metric to one number a coefficient (D,)."""


def score(
    reference: np.ndarray, predicted: np.ndarray, speech: np.ndarray | None = None, valid: np.ndarray | None = None
) -> Scores:
    """Return all metrics of one sentence: region (``speech``, ``all``) to metric to (D,).

    Args:
        reference, predicted: trajectories (T, D).
        speech: (T,) bool, frames from the first phone's start to the last one's end; all frames where None.
        valid: (T,) bool, frames whose reference was measured; all frames where None.

    Raises:
        DnnvssError: shapes that differ, or values that are not finite in valid frames.
    """
    frames = len(reference)
    kept = np.ones(frames, bool) if valid is None else np.asarray(valid, bool)
    spoken = kept if speech is None else np.asarray(speech, bool)
    if {len(kept), len(spoken), len(predicted)} != {frames}:
        raise DnnvssError(
            f"reference of {frames} frames, prediction of {len(predicted)}, speech of {len(spoken)} and valid of "
            f"{len(kept)} do not have the same frames",
            remedy="Put all of them on one clock with one frame count",
        )
    return {
        region: {name: metric(reference[mask], predicted[mask]) for name, metric in METRICS.items()}
        for region, mask in {"speech": kept & spoken, "all": kept}.items()
    }


def evaluate(
    systems: Mapping[str, Mapping[str, np.ndarray]],
    references: Mapping[str, np.ndarray],
    *,
    speech: Mapping[str, np.ndarray] | None = None,
    valid: Mapping[str, np.ndarray] | None = None,
    columns: tuple[str, ...] | None = None,
    first: int = 5,
) -> "Report":
    """Return the scores of every system on every sentence.

    Args:
        systems: name to sentence id to predicted trajectory (T, D).
        references: sentence id to measured trajectory (T, D).
        speech, valid: sentence id to (T,) bool, see :func:`score`.
        columns: names of the coefficients; ``1``, ``2``, ... where None.
        first: over how many leading coefficients the headline averages run.

    Raises:
        DnnvssError: no sentence, a system without one of them, or trajectories that do not fit; the message names both.
    """
    if not references or not systems:
        raise DnnvssError("there is nothing to evaluate", remedy="Give at least one sentence and one system")
    speech, valid = speech or {}, valid or {}
    scores: dict[str, dict[str, Scores]] = {}
    for name, predicted in systems.items():
        if missing := sorted(set(references) - set(predicted)):
            raise DnnvssError(f"system {name!r} has no prediction", utterance=missing[0], remedy="Predict them all")
        scores[name] = {}
        for i, reference in references.items():
            try:
                scores[name][i] = score(reference, predicted[i], speech.get(i), valid.get(i))
            except DnnvssError as error:
                raise DnnvssError(f"system {name!r}: {error.problem}", utterance=i, remedy=error.remedy) from error
    width = next(iter(references.values())).shape[1]
    return Report(scores, columns or tuple(str(d + 1) for d in range(width)), min(first, width))


@dataclass(frozen=True)
class Report:
    """Per-sentence scores of all systems, and their tables.

    Args:
        scores: system to sentence id to region to metric to (D,).
        columns: names of the coefficients (D,).
        first: over how many leading coefficients the headline averages run.
    """

    scores: dict[str, dict[str, Scores]]
    columns: tuple[str, ...]
    first: int = 5

    def sentences(self, system: str, metric: str, region: str = "speech") -> np.ndarray:
        """Return a metric of each sentence, averaged over the first coefficients, shape (sentences,)."""
        return mean_known(self.coefficients(system, metric, region)[:, : self.first], axis=1)

    def coefficients(self, system: str, metric: str, region: str = "speech") -> np.ndarray:
        """Return a metric of each sentence and coefficient, shape (sentences, D)."""
        return np.stack([scores[region][metric] for scores in self.scores[system].values()])

    def summary(self, system: str, metric: str, region: str = "speech") -> tuple[float, float]:
        """Return mean and standard deviation over the sentences of the average over the first coefficients.

        The standard deviation is that of the sentences (dividing by their number less one), NaN for a single one.

        **Source**: Thangthai et al. 2016, tables 3 to 5.
        """
        values = self.sentences(system, metric, region)
        known = values[~np.isnan(values)]
        spread = float(known.std(ddof=1)) if len(known) > 1 else float("nan")
        return float(mean_known(values)), spread

    def headline(self, system: str) -> float:
        """Return the mean correlation over speech on the first coefficients."""
        return self.summary(system, "correlation")[0]

    def to_json(self) -> dict[str, Any]:
        """Return plain containers: summaries, per coefficient and per sentence; NaN becomes None."""
        systems = {}
        for name, sentences in self.scores.items():
            regions: dict[str, Any] = {}
            for region in REGIONS:
                regions[region] = {metric: self._json_metric(name, metric, region) for metric in METRICS}
            systems[name] = {"sentences": list(sentences), "regions": regions}
        return {"columns": list(self.columns), "first": self.first, "systems": systems}

    def _json_metric(self, system: str, metric: str, region: str) -> dict[str, Any]:
        mean, spread = self.summary(system, metric, region)
        by_coefficient = mean_known(self.coefficients(system, metric, region), axis=0)
        return {
            "mean": _plain(mean),
            "sd": _plain(spread),
            "by_coefficient": [_plain(v) for v in by_coefficient],
            "by_sentence": [_plain(v) for v in self.sentences(system, metric, region)],
        }

    def markdown(self) -> str:
        """Return the tables in Markdown: averages over the first coefficients, then each of these over speech."""
        head = ["system", *[f"{TITLES[m]}, {r}" for r in REGIONS for m in METRICS]]
        parts = [self._caption(), markdown_numbers(head, self._rows()), self._coefficient_caption()]
        for metric in ("correlation", "rmse", "gv_ratio"):
            rows = [[s, *cells] for s, cells in self._by_coefficient(metric).items()]
            parts.append(markdown_numbers([TITLES[metric], *self.columns[: self.first]], rows))
        return "\n\n".join(parts)

    def table(self) -> str:
        """Return the tables as aligned text for the screen."""
        lines = [self._caption(), ""]
        for r, region in enumerate(REGIONS):
            width = len(METRICS)
            rows = [[row[0], *row[1 + r * width : 1 + (r + 1) * width]] for row in self._rows()]
            lines += [aligned([f"over {region}", *TITLES.values()], rows), ""]
        for metric in ("correlation", "gv_ratio"):
            rows = [[s, *cells] for s, cells in self._by_coefficient(metric).items()]
            lines += [aligned([f"{TITLES[metric]} over speech", *self.columns[: self.first]], rows), ""]
        return "\n".join(lines).rstrip()

    def _caption(self) -> str:
        count = len(next(iter(self.scores.values())))
        return (f"Mean (and sd) over {number_of(count, 'sentence')} of the average over the first {self.first} "
                "coefficients.")

    def _coefficient_caption(self) -> str:
        return "Each coefficient over speech, mean over the sentences."

    def _rows(self) -> list[list[str]]:
        return [
            [system, *[_mean_and_spread(*self.summary(system, m, region)) for region in REGIONS for m in METRICS]]
            for system in self.scores
        ]

    def _by_coefficient(self, metric: str) -> dict[str, list[str]]:
        means = {s: mean_known(self.coefficients(s, metric)[:, : self.first], axis=0) for s in self.scores}
        return {s: [number(v) for v in values] for s, values in means.items()}


def _plain(value: float) -> float | None:
    return None if np.isnan(value) else round(float(value), 6)


def _mean_and_spread(mean: float, spread: float) -> str:
    return number(mean) if np.isnan(spread) else f"{number(mean)} ({number(spread)})"
