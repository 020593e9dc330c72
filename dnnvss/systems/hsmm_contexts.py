"""The questions that decision trees ask of a phone in its sentence, and their answers from the label codes."""

from functools import cache

import numpy as np

from dnnvss.features import PhoneSegments
from dnnvss.features.sources.tree import COUNTS, POSITIONS
from dnnvss.phones import PHONES
from dnnvss.phones.questions import ANSWERS, QUESTIONS

OFFSETS = (-2, -1, 0, 1, 2)
_WHICH = ("second phone before", "phone before", "phone", "phone after", "second phone after")
_PLACES = ("at the start", "in the middle", "at the end", "in a pause")
_THRESHOLDS = (1, 2, 3, 4, 6, 9)


@cache
def context_questions() -> tuple[str, ...]:
    """Return the questions in words, in the order of the columns of :func:`context_answers`.

    Quinphone: for each of five phones, whether it is the phone X, the 57 articulatory questions, and whether it lies
    outside the utterance. Then positions (start, middle, end) in syllable, word, phrase and utterance, and counts.
    """
    asked = []
    for which in _WHICH:
        asked += [f"{which}: Is it {phone}?" for phone in PHONES]
        asked += [f"{which}: {question.asks}" for question in QUESTIONS]
        asked.append(f"{which}: Is it outside the utterance?")
    asked += [f"{name.replace('_', ' ')}: Is it {place}?" for name in POSITIONS for place in _PLACES]
    asked += [f"{name.replace('_', ' ')}: At most {limit}?" for name in COUNTS for limit in _THRESHOLDS]
    return tuple(asked)


def context_answers(phones: PhoneSegments) -> np.ndarray:
    """Yes or no (S, Q), bool, of each phone of one utterance to each question."""
    codes = phones.code
    outside = len(PHONES)
    table = np.concatenate([np.eye(outside), ANSWERS, np.zeros((outside, 1))], 1)
    table = np.concatenate([table, np.eye(table.shape[1])[-1:]]).astype(bool)
    reach = max(OFFSETS)
    padded = np.pad(codes, reach, constant_values=outside)
    parts = [table[padded[reach + offset : reach + offset + len(codes)]] for offset in OFFSETS]
    places = phones.positions[:, :, None] == np.arange(len(_PLACES))
    counts = phones.counts[:, :, None] <= np.array(_THRESHOLDS)
    return np.concatenate([*parts, places.reshape(len(codes), -1), counts.reshape(len(codes), -1)], 1)
