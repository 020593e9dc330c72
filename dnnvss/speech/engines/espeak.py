"""eSpeak NG through the package espeakng-loader, in a process of its own; found if it is installed.

The library is under the GPL-3, so it is an optional extra and is never loaded into this process (which also keeps it
repeatable: its state outlives an utterance).
"""

import json
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.phones import ARTICULATION, SILENCE, VOWELS, strip_stress
from dnnvss.speech.engines.base import Speech, fitted, read_wav, run, workshop
from dnnvss.speech.engines.matching import matched
from dnnvss.text.sentence import Sentence
from dnnvss.text.syllables import syllable_starts
from dnnvss.timing import Alignment, Segment

_WORKER = Path(__file__).with_name("espeak_worker.py")  # run as a file: it starts in a tenth of a second

_SOUNDLESS = 0.002
"""Largest sample of a closure."""

_MNEMONICS = {
    "AA": "A:", "AE": "a", "AH": "V", "AO": "O:", "AW": "aU", "AY": "aI", "EH": "E", "ER": "3:", "EY": "eI", "IH": "I",
    "IY": "i:", "OW": "oU", "OY": "OI", "UH": "U", "UW": "u:", "B": "b", "CH": "tS", "D": "d", "DH": "D", "F": "f",
    "G": "g", "HH": "h", "JH": "dZ", "K": "k", "L": "l", "M": "m", "N": "n", "NG": "N", "P": "p", "R": "r", "S": "s",
    "SH": "S", "T": "t", "TH": "T", "V": "v", "W": "w", "Y": "j", "Z": "z", "ZH": "Z",
}
_HEARD = {**{mnemonic: phone for phone, mnemonic in _MNEMONICS.items()},
          "@": "AH", "I2": "IH", "i": "IY", "3": "ER", "@L": "L", "t#": "T", "O": "AO", "0": "AA", "aa": "AE",
          "A@": "AA", "O@": "AO", "o@": "AO", "e@": "EH", "i@": "IY", "U@": "UH", "I#": "IH", "a#": "AH", "l#": "L",
          "r-": "R", "u": "UW", "n-": "N", "l-": "L", "m-": "M"}


class EspeakEngine:
    """eSpeak NG in a subprocess, told our phones."""

    name = "espeak"
    voices = ("en-us",)
    imposes = False

    def __init__(self, voice: str = "en-us") -> None:
        self.voice = voice

    def available(self) -> str | None:
        """Return None if espeakng-loader is there, else what to install."""
        if find_spec("espeakng_loader") is None:
            return "the package espeakng-loader is not installed. Install it: pip install 'dnnvss[espeak]'"
        return None

    def speak(self, sentence: Sentence, alignment: Alignment | None = None) -> Speech:
        """Return the sentence in eSpeak's own time; given times are not used.

        Raises:
            DnnvssError: the package is missing or the library failed.
        """
        if reason := self.available():
            raise DnnvssError(reason)
        with workshop() as folder:
            wav = folder / "speech.wav"
            request = json.dumps({"text": mnemonics(sentence), "voice": self.voice, "wav": str(wav)})
            printed = run([sys.executable, str(_WORKER)], self.name, request)
            samples, rate = read_wav(wav, self.name)
        try:
            events = [(str(name), int(at)) for name, at in json.loads(printed)]
        except (TypeError, ValueError) as error:
            raise DnnvssError(f"the speech engine espeak said {printed.strip()[:60]!r} of its phonemes",
                              remedy="Choose another engine, e.g. speech.engine=formant") from error
        edges = [at / rate for _, at in events] + [len(samples) / rate]
        heard = [Segment(a, b, heard_as(name)) for (name, _), a, b in zip(events, edges[:-1], edges[1:], strict=True)
                 if b > a]
        if heard and heard[0].start > 0:
            heard.insert(0, Segment(0.0, heard[0].start, SILENCE))
        timed = matched(sentence, with_closures(heard, samples, rate), self.name)
        return Speech(fitted(samples, rate, timed), rate, timed)


def with_closures(heard: Sequence[Segment], samples: np.ndarray, rate: int) -> list[Segment]:
    """Return the segments with every stop and affricate begun at its closure: eSpeak reports it at its burst.

    The closure is the stretch without sound right before the burst; after a pause it cannot be told from the pause.

    Args:
        heard: segments in our labels.
        samples: (n,) the sound, in [-1, 1].
        rate: samples a second.
    """
    rows = list(heard)
    for k, (before, own) in enumerate(pairwise(heard)):
        if ARTICULATION[own.label].manner not in ("stop", "affricate") or before.label == SILENCE:
            continue
        first, burst = round(before.start * rate), round(own.start * rate)
        sounding = np.flatnonzero(np.abs(samples[first:burst]) > _SOUNDLESS)
        closure = (first + sounding[-1] + 1) / rate if len(sounding) else own.start
        rows[k] = rows[k]._replace(end=closure)
        rows[k + 1] = rows[k + 1]._replace(start=closure)
    return rows


def mnemonics(sentence: Sentence) -> str:
    """Return the sentence in eSpeak's phoneme mnemonics, a bracket a word, with commas and stops at the breaks."""
    out = []
    for word in sentence.words:
        starts = set(syllable_starts(word.phones))
        text = ""
        for i, phone in enumerate(word.phones):
            if i in starts:
                syllable = _syllable(word.phones, i, starts)
                digits = {p[-1] for p in syllable}
                text += "'" if "1" in digits else "," if "2" in digits else ""
            weak = {"AH0": "@", "ER0": "3", "IY0": "i", "IH0": "I"}
            text += ("|" if text and text[-1] not in "',|" else "") + weak.get(phone, _MNEMONICS[strip_stress(phone)])
        out.append(f"[[{text}]]" + {"none": "", "minor": ",", "major": "."}[word.break_after])
    return " ".join(out)


def _syllable(phones: tuple[str, ...], start: int, starts: set[int]) -> tuple[str, ...]:
    end = min((s for s in starts if s > start), default=len(phones))
    return phones[start:end]


def heard_as(mnemonic: str) -> str:
    """Return our label for a mnemonic that eSpeak reports; pauses are ``sil``, an unknown one goes by its beginning."""
    bare = mnemonic.lstrip("',%=")
    if not bare.strip("_:|"):
        return SILENCE
    if bare in _HEARD:
        return _HEARD[bare]
    return next((_HEARD[bare[:n]] for n in range(len(bare), 0, -1) if bare[:n] in _HEARD), VOWELS[0])
