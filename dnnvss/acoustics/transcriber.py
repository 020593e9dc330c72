"""What is said in a sound, written down by Whisper tiny.en: a first guess, to be read by somebody."""

import zlib
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from dnnvss.acoustics.analysis import RATE
from dnnvss.acoustics.encoder_model import WEIGHTS, verified, weights_file, whisper
from dnnvss.acoustics.whisper import encoder_input
from dnnvss.errors import DnnvssError

LONGEST = 30.0
"""Seconds that are transcribed at once, as in the model's training."""
_CONFIG = "14b1b421a90349bc551b881461426b561a874049cb9e4c4864f2ca384f6a7cc5"
_VOCABULARY = "ff77588746d3a2595d32ab5b69ffd7b95ce2441ac57533cb66fc3eb575a115cf"
_WHO = "transcribe=true needs Whisper tiny.en"
_PROMPT = ("<|startoftranscript|>", "<|notimestamps|>")
_BEAM = 5
_PACE, _LEAST = 8.0, 16  # tokens a second that somebody can say, and what is always allowed
_LOOP = 2.2
"""Ratio of the bytes of a text to those of it compressed above which it goes round in circles."""
_EMPTY, _UNSURE = 0.6, -1.0
"""Chance that nobody speaks, and mean log probability of the tokens, beyond which there is no speech in a sound."""


@dataclass(frozen=True)
class Transcript:
    """What is said in a sound.

    Args:
        text: as written, empty where nobody speaks.
        score: mean log probability of its tokens.
    """

    text: str
    score: float


def check_transcriber() -> None:
    """Find out whether the transcriber is there, before hours of work.

    Raises:
        DnnvssError: it is not installed, or a file of it is another one.
    """
    _loaded()


def transcribe(samples: np.ndarray) -> Transcript:
    """What is said in samples (n,) at 16 kHz, of up to 30 s.

    Where the text goes round in circles, as small models do, it is said anew without repeating three
    tokens.

    **Source**: Radford et al. 2022, "Robust speech recognition via large-scale weak supervision",
    section 4.5.

    Raises:
        DnnvssError: the transcriber is not installed, or the sound is longer.
    """
    if len(samples) > LONGEST * RATE:
        raise DnnvssError(f"the sound lasts {len(samples) / RATE:.1f} s", remedy=f"Give at most {LONGEST:g} s at once")
    first = _said(samples, 0)
    return _said(samples, 3) if _circles(first.text) else first


def _said(samples: np.ndarray, unlike: int) -> Transcript:
    import ctranslate2

    whole = np.pad(np.asarray(samples, np.float32), (0, round(LONGEST * RATE) - len(samples)))
    view = ctranslate2.StorageView.from_array(np.ascontiguousarray(encoder_input(whole)[None]))
    most = _LEAST + round(_PACE * len(samples) / RATE)
    made = _loaded().generate(view, [list(_PROMPT)], beam_size=_BEAM, max_length=most + len(_PROMPT),
                              no_repeat_ngram_size=unlike, return_scores=True, return_no_speech_prob=True)[0]
    score = float(made.scores[0])
    silent = made.no_speech_prob > _EMPTY and score < _UNSURE
    return Transcript("" if silent else plain(made.sequences[0]), score)


def _circles(text: str) -> bool:
    data = text.encode()
    return len(data) > 40 and len(data) / len(zlib.compress(data)) > _LOOP


def plain(tokens: list[str]) -> str:
    """The text of tokens, whose letters stand for bytes as in the vocabulary of GPT-2."""
    letters = "".join(token for token in tokens if not (token.startswith("<|") and token.endswith("|>")))
    data = bytes(_BYTES[letter] for letter in letters if letter in _BYTES)
    return " ".join(data.decode("utf-8", "replace").replace("\ufffd", "").split())


def _byte_letters() -> dict[str, int]:
    """The byte that each letter stands for: those that can be seen for themselves, the others from 256 on."""
    seen = [*range(ord("!"), ord("~") + 1), *range(0xA1, 0xAD), *range(0xAE, 0x100)]
    others = [byte for byte in range(256) if byte not in seen]
    return {chr(byte): byte for byte in seen} | {chr(256 + k): byte for k, byte in enumerate(others)}


_BYTES = _byte_letters()


@lru_cache(maxsize=1)
def _loaded() -> Any:
    path = weights_file(_WHO)
    held = {"model.bin": verified(path, WEIGHTS), "config.json": verified(path.parent / "config.json", _CONFIG),
            "vocabulary.txt": verified(path.parent / "vocabulary.txt", _VOCABULARY)}
    return whisper(held, _WHO, "transcribe")
