"""A sentence laid out in time: its phones and pauses in order, stretched to a length."""

from collections.abc import Iterable

import numpy as np

from dnnvss.phones import SILENCE, SILENCES, strip_stress
from dnnvss.speech.pauses import SHORTEST, Pauses, pause_after
from dnnvss.text.sentence import Sentence
from dnnvss.timing import Alignment, Tier


def planned(sentence: Sentence, pauses: Pauses) -> Alignment:
    """Return the sentence's phones and pauses in order; phones last 0.1 s, pauses what they should."""
    phones: list[tuple[str, float]] = []
    words: list[tuple[str, float]] = []
    for number, word in enumerate(sentence.words):
        bare = [strip_stress(p) for p in word.phones]
        phones += [(p, 0.1) for p in bare]
        words.append((word.spoken, 0.1 * len(bare)))
        pause = pause_after(word, pauses)
        if pause and number < len(sentence.words) - 1:
            phones.append(pause)
            words.append(("", pause[1]))
    return Alignment([_row("phones", phones), _row("words", words)])


def asked(sentence: Sentence, plan: Alignment) -> np.ndarray:
    """Return for each pause of the plan whether the text gives its length, shape (pauses,)."""
    fixed, words = [], iter(sentence.words)
    current = None
    for label in plan["words"].labels:
        if label:
            current = next(words)
        else:
            fixed.append(current is not None and current.pause is not None)
    return np.array(fixed, dtype=bool)


def emphasised(sentence: Sentence) -> np.ndarray:
    """How strongly the text stresses each phone (n,), 0 as usual."""
    return np.array([float(w.emphasis) for w in sentence.words for _ in w.phones])


def rates(sentence: Sentence) -> np.ndarray:
    """How fast the text asks for each phone, 1 as usual."""
    return np.array([w.rate for w in sentence.words for _ in w.phones])


def stretched(mean: np.ndarray, deviation: np.ndarray, pauses: np.ndarray,
               wanted: float) -> tuple[np.ndarray, np.ndarray]:
    """Return durations (n,) and pauses whose sum is ``wanted`` seconds.

    Phones become ``exp(mean + r * deviation)`` or :data:`SHORTEST`, pauses scale by ``exp(r * average deviation)``;
    ``r`` by Newton's method on the logarithm of the sum, which is nearly a line, within bounds that close in.
    """
    pause_deviation, low, high, r = float(deviation.mean()), -40.0, 40.0, 0.0
    for _ in range(80):
        free = np.exp(mean + r * deviation)
        seconds, longer = np.maximum(free, SHORTEST), pauses * np.exp(r * pause_deviation)
        whole = float(seconds.sum() + longer.sum())
        low, high = (r, high) if whole < wanted else (low, r)
        slope = float(deviation @ np.where(free > SHORTEST, free, 0.0)) + pause_deviation * float(longer.sum())
        step = float(np.log(wanted / whole)) * whole / slope if slope > 0 else np.inf
        if abs(step) < 1e-13 * max(1.0, abs(r)):
            break
        r = r + step if low < r + step < high else (low + high) / 2
    correction = wanted / whole
    return seconds * correction, longer * correction


def _row(name: str, labelled: Iterable[tuple[str, float]]) -> Tier:
    rows, time = [], 0.0
    for label, seconds in labelled:
        rows.append((time, time + seconds, label))
        time += seconds
    return Tier(name, rows)


def laid_out(plan: Alignment, seconds: np.ndarray, pauses: np.ndarray, lead_in: float, lead_out: float) -> Alignment:
    """The plan with these lengths of its spoken phones (n,) and pauses, and with silences around it."""
    spoken, silent = iter(seconds), iter(pauses)
    lengths = [float(next(silent if s.label in SILENCES else spoken)) for s in plan["phones"]]
    phones = list(zip(plan["phones"].labels, lengths, strict=True))
    owners = plan["words"].indices_at(plan["phones"].middles).tolist()
    inside: list[list[float]] = [[] for _ in plan["words"]]
    for owner, length in zip(owners, lengths, strict=True):
        inside[owner].append(length)
    words = [(label, sum(own)) for label, own in zip(plan["words"].labels, inside, strict=True)]
    before = [(SILENCE, lead_in)] if lead_in > 0 else []
    after = [(SILENCE, lead_out)] if lead_out > 0 else []
    edge = [[("", length) for _, length in row] for row in (before, after)]
    return Alignment([_row("phones", [*before, *phones, *after]), _row("words", [*edge[0], *words, *edge[1]])])
