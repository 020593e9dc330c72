"""The stages of a long recording that run side by side: hear it, find words in it, put them in time, cut it."""

from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.errors import DnnvssError
from dnnvss.media import SOUND_RATE, SPEECH_RATE
from dnnvss.media.cutting import cut
from dnnvss.media.index import PictureIndex, picture_index
from dnnvss.media.storing import store_sound, stored, stretch
from dnnvss.speech.activity import louder, stretches
from dnnvss.speech.align import align
from dnnvss.speech.align_doubt import Word, levels
from dnnvss.speech.recognise import recognise

RECORDING, RECOGNISED, PASSAGES, CLIPS = "recording", "recognised words", "passages", "clips"
"""The stages."""
VERSION = 3
"""Of what they leave behind."""

PIECE = 20.0
"""Seconds of sound that are recognised at once, at most."""
_BLOCK = 600  # seconds of sound whose level is measured at once
_AROUND = 0.3  # seconds of silence around what is recognised
_BEFORE, _BEHIND = 0.2, 0.3
"""Seconds of silence before and behind a passage that is put in time. Given more before it, weak first sounds swallow
that, and pictures of another shot with it; final sounds die away slowly."""


def folder_of(out: Path) -> Path:
    """Where the sound of long recordings is kept."""
    return out / ".stages" / RECORDING


def hear(name: str, out: Path, video: Path) -> dict[str, Any]:
    """Seconds of a recording, after writing its sound at both rates, and what is loud in it.

    Raises:
        DnnvssError: it cannot be read, has no sound or no times of its pictures.
    """
    index = picture_index(video)
    folder = folder_of(out)
    store_sound(video, folder / f"{name}.48.wav", SOUND_RATE, index.zero)
    seconds = store_sound(folder / f"{name}.48.wav", folder / f"{name}.16.wav", SPEECH_RATE)
    samples = stored(folder / f"{name}.16.wav")
    size = _BLOCK * SPEECH_RATE
    level = np.concatenate([levels(samples[at : at + size] / np.float32(32767)) for at in range(0, len(samples), size)])
    files.write_arrays(folder / f"{name}.npz", active=louder(level), stamps=index.stamps, keys=index.keys)
    return {"seconds": seconds, "base": str(index.base), "zero": index.zero, "codec": index.codec,
            "late": index.late}


def pieces_of(loud: np.ndarray) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """Stretches of speech between pauses, and pieces of up to 20 s that are made of them, in seconds.

    Args:
        loud: (n,) bool, whether each 10 ms is louder than silence.
    """
    spans = stretches(loud)
    pieces: list[tuple[float, float]] = []
    for start, end in spans:
        if pieces and end - pieces[-1][0] <= PIECE:
            pieces[-1] = pieces[-1][0], end
        else:
            count = int(np.ceil((end - start) / PIECE))
            edges = np.linspace(start, end, count + 1)
            pieces += [(float(a), float(b)) for a, b in pairwise(edges)]
    return spans, pieces


def find_words(name: str, out: Path, wav: Path, start: float, end: float, vocabulary: str,
               text: str) -> dict[str, Any]:
    """The words that are recognised in a piece, on the time line of the recording.

    Args:
        name, out: not used.
        wav: the sound at 16 kHz.
        start, end: of the piece in seconds.
        vocabulary: the folder of the text's vocabulary.
        text: what tells it from that of another text.
    """
    begin = max(start - _AROUND, 0.0)
    heard = recognise(stretch(wav, SPEECH_RATE, begin, end + _AROUND), Path(vocabulary))
    return {"words": [[word.word, round(word.start + begin, 3), round(word.end + begin, 3)] for word in heard]}


def put_in_time(name: str, out: Path, wav: Path, start: float, end: float, words: list[Word]) -> dict[str, Any]:
    """Start, end and score of each word of a passage, on the time line of the recording.

    Args:
        name, out: not used.
        wav: the sound at 16 kHz.
        start, end: of the passage in seconds.
        words: each with its pronunciations.

    Raises:
        DnnvssError: the words are not in the sound.
    """
    begin = max(start - _BEFORE, 0.0)
    try:
        found = align(stretch(wav, SPEECH_RATE, begin, end + _BEHIND), words, sharp=False)
    except DnnvssError as error:
        raise DnnvssError(error.problem) from error
    spans = [s for s in found.alignment["words"] if s.label]
    return {"words": [[round(s.start + begin, 4), round(s.end + begin, 4), round(score, 2)]
                      for s, score in zip(spans, found.scores, strict=True)]}


def cut_clip(name: str, out: Path, recording: str, video: Path, sound: Path, pictures: dict[str, Any], start: float,
             end: float) -> dict[str, Any]:
    """The clip of an utterance, which pictures of the recording it holds and when it begins.

    Args:
        name: the utterance id.
        out: the prepared corpus.
        recording: the id of the recording.
        video: the recording.
        sound: its sound at 48 kHz.
        pictures: base, zero, codec and late of its pictures.
        start, end: seconds in the recording.
    """
    kept = read_arrays(folder_of(out) / f"{recording}.npz", "Delete .stages and prepare again")
    index = PictureIndex(Fraction(pictures["base"]), kept["stamps"], kept["keys"], pictures["zero"], pictures["codec"],
                         pictures["late"])
    path = out / ".stages" / CLIPS / f"{name}.mp4"
    made = cut(video, index, sound, start, end, path)
    return {"clip": str(path.relative_to(out)), "first": made.first, "end": made.end, "start": round(made.start, 5),
            "copied": made.copied}

