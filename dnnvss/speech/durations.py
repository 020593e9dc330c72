"""How long phones last: a regression learnt from a corpus, and what it says of new sentences."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dnnvss import files
from dnnvss.archives import Held, read_declared
from dnnvss.corpus.utterance import Utterance
from dnnvss.errors import DnnvssError
from dnnvss.phones import ARTICULATION, SILENCES
from dnnvss.speech.duration_contexts import ALWAYS, context_matrix, each_context
from dnnvss.speech.pauses import SHORTEST, Pauses, usual_pauses
from dnnvss.speech.time_line import asked, emphasised, laid_out, planned, rates, stretched
from dnnvss.text.sentence import Sentence
from dnnvss.timing import Alignment

if TYPE_CHECKING:
    import scipy.sparse

Expected = Callable[[Alignment, str], np.ndarray]
"""What tells the expected seconds (n,) of each spoken phone of an alignment and its text, whatever its times are."""
_SLOWEST = 20
"""How many times longer than the talker's a total length may let phones last."""

_PENALTIES = (0.3, 1.0, 3.0, 10.0, 30.0)
_FOLDS = 5
_ARRAYS = {"columns": Held(("columns",), "U"), "weights": Held(("columns",)), "variance_of": Held(("phones",), "U"),
           "variance": Held(("phones",)), "pause_labels": Held((3,), "U"), "pause_seconds": Held((3,))}
_EMPHASIS = 0.8  # standard deviations by which an emphasised phone is longer


@dataclass(frozen=True)
class DurationModel:
    """A ridge regression from a phone's context to the logarithm of its duration in seconds.

    ``log d ~ Normal(weights . context, variance[phone])``; the expected duration is ``exp(mean + variance / 2)``.

    Args:
        columns: names of the context features, such as ``phone=AA``, ``next=stop-``, ``in phrase=last``.
        weights: (len(columns),) in log seconds.
        variance: variance of the log duration about the mean, by phone, by class and for all.
        pauses: pauses between words.
    """

    columns: tuple[str, ...]
    weights: np.ndarray
    variance: dict[str, float]
    pauses: Pauses

    @classmethod
    def fit(cls, utterances: Sequence[Utterance]) -> "DurationModel":
        """Return a model of the durations in aligned utterances; the penalty is chosen by cross-validation over them.

        Raises:
            DnnvssError: fewer than two utterances, or no spoken phone in them.
        """
        if len(utterances) < 2:
            raise DnnvssError(f"a duration model cannot be learnt from {len(utterances)} utterance(s)",
                              remedy="Give the training split of a corpus")
        known, logs, groups = dict[str, int](), list[np.ndarray](), list[int]()
        contexts: list[list[int]] = []  # by number: the names of an hour would take a hundred megabytes
        for number, utterance in enumerate(utterances):
            rows, seconds = each_context(utterance.alignment, utterance.text)
            contexts += [[known.setdefault(name, len(known)) for name in row] for row in rows]
            logs.append(np.log(np.maximum(seconds, SHORTEST)))
            groups += [number % _FOLDS] * len(seconds)
        if not contexts:
            raise DnnvssError("the utterances have no spoken phone", remedy="Align the corpus first")
        columns, y = tuple(sorted(known)), np.concatenate(logs)
        place = np.argsort([known[name] for name in columns])
        places = place[np.array(contexts)]
        x = context_matrix(places, len(columns))
        weights = _ridge(x, y, np.array(groups))
        weights[columns.index(ALWAYS)] += y.mean()
        return cls(columns, weights, _variances(columns, places, y - x @ weights), usual_pauses(utterances))

    def borrowing(self, other: "DurationModel") -> "DurationModel":
        """This model with what another talker's adds for phones that this corpus lacks.

        A phone's weight is what it adds to its class and context; these stay the talker's own.
        """
        theirs = dict(zip(other.columns, other.weights, strict=True))
        lacking = [p for p in ARTICULATION if p in theirs and p not in self.columns]
        return DurationModel((*self.columns, *lacking), np.array([*self.weights, *(theirs[p] for p in lacking)]),
                             {**{p: other.variance[p] for p in lacking if p in other.variance}, **self.variance},
                             self.pauses)

    def log_durations(self, alignment: Alignment, text: str) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and standard deviation (n,) of the log duration of each spoken phone, whatever its times are.

        A phone that the corpus lacks has the columns of its class only.
        """
        rows, _ = each_context(alignment, text)
        adds, means, variances = self._adds, list[float](), list[float]()
        for row in rows:  # one by one: the contexts of an hour of speech never lie there at once
            means.append(sum(adds.get(name, 0.0) for name in dict.fromkeys(row)))
            variances.append(next(self.variance[name] for name in row if name in self.variance))
        return np.array(means), np.sqrt(variances)

    @cached_property
    def _adds(self) -> dict[str, float]:
        """What each context feature adds to the log duration."""
        return dict(zip(self.columns, self.weights.tolist(), strict=True))

    def durations(self, alignment: Alignment, text: str) -> np.ndarray:
        """Return the expected duration (n,) in seconds of each spoken phone, whatever its times are."""
        mean, deviation = self.log_durations(alignment, text)
        return np.exp(mean + deviation**2 / 2)

    def predict(self, sentence: Sentence, rate: float = 1.0, total: float | None = None, lead_in: float = 0.2,
                lead_out: float = 0.3, expected: Expected | None = None) -> Alignment:
        """Return a time line for a sentence, with the tiers ``phones`` and ``words``.

        To speak faster or slower, and to meet a total length, each phone is moved by the same number of its own
        standard deviations of log duration, so that elastic phones give way more than stiff ones; pauses scale.

        Args:
            rate: speaking rate, 1 as in the corpus, 2 twice as fast.
            total: length in seconds to meet exactly, silences at both ends included; then ``rate`` is not used.
            lead_in, lead_out: seconds of silence before and after, 0 for none; pauses that the text asks for there are
                added.
            expected: another source of the expected seconds (n,) of each spoken phone; this model's own if left out.

        Raises:
            DnnvssError: a rate outside 0.25 to 4, negative silences, or a total that is too short or too long for the
                phones.
        """
        if not 0.25 <= rate <= 4 or lead_in < 0 or lead_out < 0:
            raise DnnvssError(f"cannot speak at a speed of {rate} with silences of {lead_in} and {lead_out} s",
                              remedy="Give speed=0.25 to 4, and silences (lead_in, lead_out) of 0 or more")
        lead_in, lead_out = lead_in + sentence.pause_before, lead_out + sentence.pause_after
        plan = planned(sentence, self.pauses)
        mean, deviation = self.log_durations(plan, sentence.text)
        mean = mean + deviation**2 / 2 if expected is None else np.log(expected(plan, sentence.text))
        mean = mean + _EMPHASIS * deviation * emphasised(sentence) - np.log(rates(sentence))
        pauses = np.array([s.duration for s in plan["phones"] if s.label in SILENCES])
        fixed = asked(sentence, plan)
        wanted = (np.exp(mean).sum() + pauses[~fixed].sum()) / rate
        if total is not None:
            wanted = total - lead_in - lead_out - pauses[fixed].sum()
            if wanted < 2 * SHORTEST * len(mean):
                silence = lead_in + lead_out
                raise DnnvssError(f"{total} s are too short for {len(mean)} phones and {silence:.2f} s of silence",
                                  remedy=f"Give at least {total - wanted + 2 * SHORTEST * len(mean):.2f} s")
            if wanted > (most := _SLOWEST * (np.exp(mean).sum() + pauses[~fixed].sum())):
                raise DnnvssError(f"{total:g} s are too long for {len(mean)} phones",
                                  remedy=f"Give at most {total - wanted + most:.2f} s, or more silence around the "
                                  "words (lead_in, lead_out, [pause 2s])")
        seconds, pauses[~fixed] = stretched(mean, deviation, pauses[~fixed], float(wanted))
        return laid_out(plan, seconds, pauses, lead_in, lead_out)

    def save(self, path: str | Path) -> Path:
        """Write the model as ``.npz`` of plain arrays and return the path."""
        pauses = [self.pauses.none, self.pauses.minor, self.pauses.major]
        return files.write_arrays(
            path, columns=np.array(self.columns), weights=self.weights, variance_of=np.array(list(self.variance)),
            variance=np.array(list(self.variance.values())), pause_labels=np.array([p[0] if p else "" for p in pauses]),
            pause_seconds=np.array([p[1] if p else 0.0 for p in pauses]))

    @classmethod
    def load(cls, path: str | Path) -> "DurationModel":
        """Return the model in a file written by :meth:`save`.

        Raises:
            DnnvssError: the file is missing, damaged or of another kind.
        """
        remedy = "Train again: the duration model is written beside the checkpoint"
        a = read_declared(path, _ARRAYS, remedy)
        pauses = [(str(p), float(s)) if p else None for p, s in zip(a["pause_labels"], a["pause_seconds"], strict=True)]
        variance = {str(k): float(v) for k, v in zip(a["variance_of"], a["variance"], strict=True)}
        columns = tuple(map(str, a["columns"]))
        silent = all(p is None or (p[0] in SILENCES and p[1] > 0) for p in pauses)
        if not silent or ALWAYS not in variance or ALWAYS not in columns or min(variance.values()) < 0:
            raise DnnvssError("is no duration model", file=path, remedy=remedy)
        return cls(columns, a["weights"], variance, Pauses(*pauses))


def _ridge(x: "scipy.sparse.csr_matrix", y: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Return the weights for what differs from the mean, under the penalty with the least error on groups left out."""
    centre = y.mean()
    parts = [(x[groups == g], groups == g) for g in np.unique(groups)]
    folds = [((own.T @ own).toarray(), own.T @ (y[rows] - centre), rows) for own, rows in parts]
    gram, moment = sum(f[0] for f in folds), sum(f[1] for f in folds)
    eye = np.eye(x.shape[1])

    def error(penalty: float) -> float:
        total = 0.0
        for part, part_moment, rows in folds:
            w = np.linalg.solve(gram - part + penalty * eye, moment - part_moment)
            total += float(((y[rows] - centre - x[rows] @ w) ** 2).sum())
        return total

    best = min(_PENALTIES, key=error) if len(folds) > 1 else _PENALTIES[-1]
    return np.asarray(np.linalg.solve(gram + best * eye, moment))


def _variances(columns: Sequence[str], places: np.ndarray, residual: np.ndarray) -> dict[str, float]:
    """Return the variance of the residual of each phone, class and of all, rare ones drawn toward the overall one.

    Args:
        columns: names of contexts.
        places: those of each row, (n, K); the first three are phone, class and all.
        residual: (n,).
    """
    overall = float((residual**2).mean())
    found = {}
    for level in range(3):
        counts = np.bincount(places[:, level], minlength=len(columns))
        squares = np.bincount(places[:, level], residual**2, minlength=len(columns))
        for k in np.flatnonzero(counts).tolist():
            found[columns[k]] = max(float((squares[k] + 20 * overall) / (counts[k] + 20)), 1e-4)
    return found
