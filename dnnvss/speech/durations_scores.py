"""How good a duration model is: error and correlation a phone, beside two null models."""

from collections import defaultdict
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dnnvss.corpus.utterance import Utterance
from dnnvss.errors import DnnvssError
from dnnvss.speech.duration_contexts import spoken_contexts
from dnnvss.speech.durations import DurationModel, Expected


@dataclass(frozen=True)
class DurationScore:
    """Root mean squared error in milliseconds, and correlation, over the spoken phones of held-out utterances."""

    system: str
    rmse: float
    correlation: float


def score_durations(model: DurationModel, train: Sequence[Utterance], test: Sequence[Utterance],
                    others: Mapping[str, Expected] | None = None) -> list[DurationScore]:
    """Return the scores of two null models learnt on ``train``, of the model, and of ``others`` on ``test``.

    The null models are the mean duration of each phone, and the mean of each phone at each position (onset, nucleus or
    coda, and whether word, phrase or utterance end with its syllable).

    Raises:
        DnnvssError: there is no phone to test on.
    """
    if not test:
        raise DnnvssError("no utterance to test durations on", remedy="Give the test split of a corpus")
    seen, truth = _rows(train), _rows(test)
    seconds = np.array([s for _, s in truth])
    by_phone = _means(seen, truth, lambda row: row[0])
    by_place = _means(seen, truth, lambda row: tuple(n for n in row if n.startswith(f"{row[0]} "))[:2], by_phone)
    models = {"duration model": model.durations, **(others or {})}
    predicted = {name: np.concatenate([tell(u.alignment, u.text) for u in test]) for name, tell in models.items()}
    scored = {"phone mean": by_phone, "phone mean by position": by_place, **predicted}
    return [_score(name, values, seconds) for name, values in scored.items()]


def _rows(utterances: Sequence[Utterance]) -> list[tuple[list[str], float]]:
    found: list[tuple[list[str], float]] = []
    for utterance in utterances:
        contexts, seconds = spoken_contexts(utterance.alignment, utterance.text)
        found += zip(contexts, seconds.tolist(), strict=True)
    return found


def _means(seen: list[tuple[list[str], float]], wanted: list[tuple[list[str], float]],
           key: Callable[[list[str]], Hashable], fallback: np.ndarray | None = None) -> np.ndarray:
    """Return for each wanted row the mean duration (n,) of the seen rows with its key; the fallback where none is."""
    groups: dict[Hashable, list[float]] = defaultdict(list)
    for row, seconds in seen:
        groups[key(row)].append(seconds)
    overall = float(np.mean([s for _, s in seen]))
    default = np.full(len(wanted), overall) if fallback is None else fallback
    return np.array([np.mean(groups[key(row)]) if key(row) in groups else d
                     for (row, _), d in zip(wanted, default, strict=True)])


def _score(system: str, predicted: np.ndarray, truth: np.ndarray) -> DurationScore:
    rmse = 1000 * float(np.sqrt(((predicted - truth) ** 2).mean()))
    return DurationScore(system, rmse, float(np.corrcoef(predicted, truth)[0, 1]))
