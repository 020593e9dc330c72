"""Answers as numbers: who judged what, and how; viewers whose attention failed are kept apart."""

import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dnnvss.evaluation.viewing.answers import Answer, Row
from dnnvss.evaluation.viewing.sheet import Sheet, Trial

EDGE = 10.0
"""Points from an end of a scale within which an attention check wants the slider."""


@dataclass(frozen=True)
class Judgements:
    """Judgements of one kind, a row each.

    Args:
        viewer, sentence, condition: numbers (N,); of pairs ``condition`` is (N, 2), from left to right.
        value: (N,): 1 where the left one was preferred, 0 where the right one was, 0.5 for a tie; 1 where a stimulus
            was called real, or its word was told; or a score of 0 to 100. Of a DSCQS test (N, 2).
        viewers: names of the files, by number.
    """

    viewer: np.ndarray
    sentence: np.ndarray
    condition: np.ndarray
    value: np.ndarray
    viewers: tuple[str, ...]

    def of(self, kept: Sequence[str]) -> "Judgements":
        """The judgements of some viewers, in the order of their names here."""
        names = [name for name in self.viewers if name in set(kept)]
        number = {self.viewers.index(name): k for k, name in enumerate(names)}
        mask = np.isin(self.viewer, list(number))
        viewer = np.array([number[int(v)] for v in self.viewer[mask]], dtype=int)
        return Judgements(viewer, self.sentence[mask], self.condition[mask], self.value[mask], tuple(names))

    def table(self, conditions: int) -> np.ndarray:
        """Mean values (viewers, conditions) of a test without pairs, NaN where a viewer did not see a condition."""
        return _means(self.viewer, self.condition, self.value, len(self.viewers), conditions)

    def grid(self, conditions: int, sentences: int) -> np.ndarray:
        """Values (viewers, conditions * sentences) of a test without pairs, NaN where nothing was asked."""
        cell = self.condition * sentences + self.sentence
        return _means(self.viewer, cell, self.value, len(self.viewers), conditions * sentences)

    def single(self) -> "Judgements":
        """The scores of both stimuli of each pair as rows of their own; without pairs, itself."""
        if self.condition.ndim == 1:
            return self
        twice = {name: np.repeat(getattr(self, name), 2) for name in ("viewer", "sentence")}
        return Judgements(condition=self.condition.ravel(), value=self.value.ravel(), viewers=self.viewers, **twice)

    def less(self, reference: int) -> "Judgements":
        """The score of the other one of each pair less that of the reference; the others are numbered without it."""
        left, right = self.condition.T
        turned = left != reference
        other = np.where(turned, left, right)
        points = np.where(turned, 1.0, -1.0) * (self.value[:, 0] - self.value[:, 1])
        return Judgements(self.viewer, self.sentence, other - (other > reference), points, self.viewers)


def _means(row: np.ndarray, column: np.ndarray, value: np.ndarray, rows: int, columns: int) -> np.ndarray:
    total, count = np.zeros((rows, columns)), np.zeros((rows, columns))
    np.add.at(total, (row, column), value)
    np.add.at(count, (row, column), 1)
    return np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0)


def judgements(sheet: Sheet, answers: Mapping[str, Answer]) -> Judgements:
    """All judgements in some answers; attention checks are none."""
    what = {s.id: (s.condition, s.sentence) for s in sheet.stimuli}
    viewer, sentence, condition, value = [], [], [], list[object]()
    pairs = sheet.design["kind"] in ("preference", "dscqs")
    for number, answer in enumerate(answers.values()):
        for row in answer.rows:
            trial = sheet.trials[row.trial]
            if trial.expect is not None:
                continue
            seen = [what[name] for name in trial.stimuli]
            viewer.append(number)
            sentence.append(seen[0][1])
            condition.append([c for c, _ in seen] if pairs else seen[0][0])
            value.append(_value(sheet, row, seen[0][1]))
    shape = (-1, 2) if pairs else (-1,)
    values = np.array(value, dtype=float)
    if sheet.design["kind"] == "dscqs":
        values = values.reshape(-1, 2)
    return Judgements(np.array(viewer, int), np.array(sentence, int), np.array(condition, int).reshape(shape), values,
                      tuple(answers))


def _value(sheet: Sheet, row: Row, sentence: int) -> float | list[float]:
    kind = sheet.design["kind"]
    if kind == "preference":
        return {"left": 1.0, "right": 0.0, "tie": 0.5}[str(row.choice)]
    if kind == "turing":
        return float(row.choice == "real")
    if kind == "intelligibility":
        return float(told(str(row.word), sheet.words[sentence]))
    return list(row.scores) if kind == "dscqs" else row.scores[0]


def told(word: str, said: str) -> bool:
    """Whether a typed word is the one that was said: as it is written, or as it sounds."""
    from dnnvss.text.lexicon import looked_up

    own, other = _letters(word), _letters(said)
    if own == other:
        return True
    return bool(own) and bool({tuple(p) for p in looked_up(own)} & {tuple(p) for p in looked_up(other)})


def _letters(word: str) -> str:
    plain = unicodedata.normalize("NFKC", word).lower()
    return "".join(c for c in plain if c.isalpha() or c == "'").strip("'")


def failed_checks(sheet: Sheet, answer: Answer) -> tuple[int, int]:
    """How many attention checks a viewer failed, and how many there were."""
    checks = [(row, sheet.trials[row.trial]) for row in answer.rows if sheet.trials[row.trial].expect is not None]
    return sum(not _attended(row, trial) for row, trial in checks), len(checks)


def _attended(row: Row, trial: Trial) -> bool:
    if trial.expect == "least":
        return max(row.scores) <= EDGE
    if trial.expect == "most":
        return min(row.scores) >= 100 - EDGE
    given = row.choice if row.word is None else _letters(row.word)
    wanted = trial.expect if row.word is None else _letters(str(trial.expect))
    return given == wanted
