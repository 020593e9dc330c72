"""When each phone is spoken: a mean per phone, stretched by stress, place in the phrase, tempo and chance."""

from collections.abc import Mapping

import numpy as np

from dnnvss.corpus.talker.grammar import spoken_words
from dnnvss.corpus.talker.vocabulary import spoken_forms
from dnnvss.phones import SHORT_PAUSE, SILENCE, VOWELS, strip_stress
from dnnvss.timing import Alignment, Tier

MEAN_MS: dict[str, float] = {
    "AA": 120, "AE": 125, "AH": 92, "AO": 122, "AW": 165, "AY": 160, "EH": 105, "ER": 108, "EY": 130, "IH": 86,
    "IY": 105, "OW": 135, "OY": 175, "UH": 88, "UW": 112,
    "B": 74, "CH": 112, "D": 62, "DH": 56, "F": 100, "G": 70, "HH": 64, "JH": 98, "K": 82, "L": 68, "M": 76, "N": 66,
    "NG": 78, "P": 88, "R": 70, "S": 108, "SH": 114, "T": 72, "TH": 92, "V": 74, "W": 74, "Y": 66, "Z": 90, "ZH": 92,
}  # fmt: skip
"""Mean length of each phone in running speech, in milliseconds."""

_UNSTRESSED, _FINAL = 0.72, 1.45
_TEMPO_SD, _PHONE_SD = 0.09, 0.14  # of the logarithm of the length: a sentence's, a phone's
_SHORTEST = 0.035
_EDGE, _PAUSE = (0.28, 0.48), (0.10, 0.30)  # silence at both ends, pause at a comma; seconds, uniform


def speak(text: str, random: np.random.Generator, forms: Mapping[str, tuple[str, ...]] | None = None) -> Alignment:
    """Return the tiers ``phones`` and ``words`` of a sentence; a pause is ``sil`` or ``sp``, ``""`` among the words.

    The length of a phone is its mean x tempo of the sentence x stress (0.72 for vowels without it) x position (the last
    vowel of a phrase and what follows it last 1.45 times as long) x chance, and never under 35 ms.

    Args:
        text: of known words.
        random: of tempo, chance and pauses.
        forms: the phones of each word; those of the talker's vocabulary where None.
    """
    known = spoken_forms() if forms is None else forms
    tempo = np.exp(random.normal(0, _TEMPO_SD))
    phones: list[tuple[float, float, str]] = []
    words: list[tuple[float, float, str]] = []
    clock = _append(phones, 0.0, SILENCE, random.uniform(*_EDGE))
    _append(words, 0.0, "", clock)
    phrases = spoken_words(text)
    for number, phrase in enumerate(phrases):
        spoken = [known[word] for word in phrase]
        lengths = iter(_lengths([phone for form in spoken for phone in form], tempo, random))
        for word, form in zip(phrase, spoken, strict=True):
            start = clock
            for phone in form:
                clock = _append(phones, clock, strip_stress(phone), next(lengths))
            _append(words, start, word, clock - start)
        last = number == len(phrases) - 1
        pause = random.uniform(*(_EDGE if last else _PAUSE))
        _append(words, clock, "", pause)
        clock = _append(phones, clock, SILENCE if last else SHORT_PAUSE, pause)
    return Alignment([Tier("phones", phones), Tier("words", words)])


def _append(row: list[tuple[float, float, str]], start: float, label: str, length: float) -> float:
    end = float(start + length)
    row.append((start, end, label))
    return end


def _lengths(phones: list[str], tempo: float, random: np.random.Generator) -> np.ndarray:
    """Return the length in seconds of each phone of a phrase; stress digits tell which vowels are stressed."""
    names = [strip_stress(phone) for phone in phones]
    mean = np.array([MEAN_MS[name] for name in names]) / 1000
    stress = np.array([_UNSTRESSED if phone.endswith("0") else 1.0 for phone in phones])
    last_vowel = max(index for index, name in enumerate(names) if name in VOWELS)
    final = np.where(np.arange(len(names)) >= last_vowel, _FINAL, 1.0)
    chance = np.exp(random.normal(0, _PHONE_SD, len(names)))
    return np.maximum(mean * stress * final * tempo * chance, _SHORTEST)
