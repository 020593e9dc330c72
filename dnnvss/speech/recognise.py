"""Which words of a known text are heard in a sound, and when."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pocketsphinx import Decoder

from dnnvss import files
from dnnvss.speech.align_sphinx import EDGE, STEP, as_pcm, listen
from dnnvss.speech.grams import trigrams

Ways = Sequence[tuple[str, ...]]
"""Pronunciations of a word."""


class HeardWord(NamedTuple):
    """A word that was heard: its number in the vocabulary, start and end in seconds."""

    word: int
    start: float
    end: float


def write_vocabulary(folder: Path, words: Sequence[str], ways: Mapping[str, Ways]) -> tuple[str, ...]:
    """Write what :func:`recognise` needs for a text, and return its vocabulary in the order of the numbers.

    Args:
        folder: where the dictionary and the language model go.
        words: the text as it is spoken.
        ways: the pronunciations of each of its words.
    """
    vocabulary = tuple(sorted(set(words)))
    number = {word: k for k, word in enumerate(vocabulary)}
    lines = [f"w{k}{f'({n})' if n > 1 else ''} {' '.join(phones)}" for k, word in enumerate(vocabulary)
             for n, phones in enumerate(ways[word], 1)]
    files.write_text(folder / "words.dict", "\n".join(lines) + "\n")
    files.write_text(folder / "words.arpa", trigrams([f"w{number[word]}" for word in words]))
    return vocabulary


def recognise(samples: np.ndarray, folder: Path) -> list[HeardWord]:
    """The words that are heard in sound (n,) at 16 kHz with the vocabulary that :func:`write_vocabulary` wrote."""
    decoder = _decoder(folder, (folder / "words.arpa").stat().st_mtime_ns)
    if len(samples) < _LEAST or not listen(decoder, as_pcm(samples)):
        return []
    found = []
    for part in decoder.seg() or ():
        name = part.word.split("(")[0]
        if name[:1] == "w" and name[1:].isdigit():
            found.append(HeardWord(int(name[1:]), part.start_frame * STEP + EDGE, (part.end_frame + 1) * STEP + EDGE))
    return found


_LEAST = 1600  # samples in which a word can be


@lru_cache(maxsize=2)
def _decoder(folder: Path, _written: int) -> Any:
    return Decoder(lm=str(folder / "words.arpa"), dict=str(folder / "words.dict"), dither=False, loglevel="FATAL")
