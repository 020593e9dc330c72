"""Two passes of pocketsphinx: words in the sound, then the phones inside them."""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pocketsphinx import Decoder, get_model_path

from dnnvss.media import SPEECH_RATE
from dnnvss.phones import SILENCE

STEP = 0.01
"""Seconds from one frame of the acoustic model to the next."""

EDGE = 0.004
"""Seconds by which the edge between two frames lies after the start of the later one's window.

By the middle of the window (25.6 ms wide) it would be 7.8 ms; against the known phone times of three synthetic voices
(300 sentences) that is 3.6 ms late in the median."""

_LOG_BASE = 1.0001
"""Base of the decoder's logarithms."""

Pronunciations = Sequence[tuple[str, ...]]


class Heard(NamedTuple):
    """A phone that the aligner heard: index of its word (-1 in silence), label, start and end in seconds, log score."""

    word: int
    phone: str
    start: float
    end: float
    score: float


class _Vocabulary:
    """A decoder and the names under which it knows pronunciations: the same spelling may be said in several ways."""

    def __init__(self, beam: float) -> None:
        self.decoder = Decoder(lm=None, dict=None, bestpath=False, beam=beam, wbeam=beam, pbeam=beam, dither=False,
                               loglevel="FATAL")
        self.names: dict[tuple[tuple[str, ...], ...], str] = {}

    def name(self, pronunciations: Pronunciations) -> str:
        key = tuple(tuple(p) for p in pronunciations)
        if key not in self.names:
            self.names[key] = f"w{len(self.names)}"
            for number, phones in enumerate(key, start=1):
                self.decoder.add_word(self.names[key] + (f"({number})" if number > 1 else ""), " ".join(phones), True)
        return self.names[key]


@lru_cache(maxsize=4)
def _vocabulary(beam: float) -> _Vocabulary:
    return _Vocabulary(beam)


def decode(samples: np.ndarray, words: Sequence[Pronunciations], beam: float) -> list[Heard] | None:
    """Return what was heard in sound (n,) at 16 kHz, silences included, or None where the words were not found.

    Args:
        samples: mono, in [-1, 1].
        words: the pronunciations of each word in turn.
        beam: how much less likely than the best a path may be and still be followed.
    """
    vocabulary = _vocabulary(beam)
    decoder, names = vocabulary.decoder, [vocabulary.name(w) for w in words]
    pcm = as_pcm(samples)
    try:
        decoder.set_align_text(" ".join(names))
        _pass(decoder, pcm)
        if decoder.hyp() is None:
            return None
        decoder.set_alignment()
        _pass(decoder, pcm)
        entries = decoder.get_alignment()
    except RuntimeError:  # the only way in which the decoder says that it found no path
        return None
    return _heard(entries, len(names)) if entries is not None else None


@lru_cache(maxsize=1)
def _phone_loop() -> Any:
    phones = str(Path(get_model_path()) / "en-us" / "en-us-phone.lm.bin")
    return Decoder(lm=None, dict=None, allphone=phones, allphone_ci=True, lw=2.0, beam=1e-20, pbeam=1e-10, dither=False,
                   loglevel="FATAL")


def free_scores(samples: np.ndarray) -> np.ndarray:
    """Return the log score of every frame of sound (n,) at 16 kHz under the phones that fit it best, whatever they are.

    Units are those of :class:`Heard`; beyond the last frame there are zeros to ``n // 160 + 1``.
    """
    decoder, found = _phone_loop(), np.zeros(len(samples) * 100 // SPEECH_RATE + 1)
    _pass(decoder, as_pcm(samples))
    for part in decoder.seg() or ():
        frames = slice(part.start_frame, part.end_frame + 1)
        found[frames] = np.log(part.ascore) / np.log(_LOG_BASE) / (part.end_frame + 1 - part.start_frame)
    return found


def _pass(decoder: Any, pcm: bytes) -> None:
    decoder.reinit_feat()  # forgets the noise and the level of what was heard before
    decoder.start_utt()
    try:
        decoder.process_raw(pcm, full_utt=True)
    finally:
        decoder.end_utt()


def listen(decoder: Any, pcm: bytes) -> bool:
    """Let a decoder hear a sound anew, and return whether it found anything."""
    try:
        _pass(decoder, pcm)
    except RuntimeError:  # the only way in which the decoder says that it found no path
        return False
    return decoder.hyp() is not None


def as_pcm(samples: np.ndarray) -> bytes:
    """Return 16-bit samples with a bit of noise, the same for the same length: digital silence has no logarithm."""
    dither = np.random.default_rng(0).uniform(-1.5, 1.5, len(samples))
    return np.clip(samples * 32767 + dither, -32768, 32767).astype("<i2").tobytes()


def _heard(entries: Any, count: int) -> list[Heard] | None:
    heard, word = [], -1
    for entry in entries:
        silent = not entry.name.startswith("w")
        word += not silent
        for part in entry:
            start = part.start * STEP + EDGE
            label = SILENCE if silent else part.name
            heard.append(Heard(-1 if silent else word, label, start, start + part.duration * STEP, part.score))
    return heard if word + 1 == count else None
