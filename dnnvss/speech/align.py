"""Forced alignment that says how sure it is, and refuses text that was not said."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.media import SPEECH_RATE
from dnnvss.speech.align_doubt import DOUBTFUL, Word, doubt, levels, noisy, score, without_rumble
from dnnvss.speech.align_edges import sharpened
from dnnvss.speech.align_onset import given_back
from dnnvss.speech.align_sphinx import decode
from dnnvss.speech.align_tiers import tiers
from dnnvss.timing import Alignment

QUIET = 1e-3
"""Largest sample of a sound that is taken to hold nothing."""

LASTING = 5
"""Stretches of 10 ms that tell speech from clicks: passes over the silence before and behind speech take as long as
passes over speech."""

_BEAM, _WIDE_BEAM = 1e-80, 1e-200

_NOT_FOUND = "was not found in the sound"

_LEAST = 0.03
"""Seconds that a phone takes at least: three frames of the acoustic model."""


class UnfitError(DnnvssError):
    """The words do not fit the sound, as far as this aligner can tell."""


@dataclass(frozen=True)
class Aligned:
    """Phones and words on the time line of a recording, and how sure they are.

    Args:
        alignment: tiers ``phones`` and ``words`` from 0 to the end of the sound.
        scores: mean log score a frame of each word, in the order of the words; about -13 where all is well, below -30
            where it is doubtful.
        attempt: which of the attempts succeeded, in words.
    """

    alignment: Alignment
    scores: tuple[float, ...]
    attempt: str


def align(audio: np.ndarray, words: Sequence[Word], bounds: Sequence[tuple[float, float]] | None = None,
          slack: float = 0.25, sharp: bool = True, lasting: int = 1) -> Aligned:
    """Return the phones and words of a recording, in time.

    Where speech seems to drown in noise, what is lower than a voice is taken out first.

    Each attempt is two passes of pocketsphinx over a stretch of the sound; the first one that finds all words with a
    credible score is taken: the spoken part, the whole recording, half the gain, and where none of these found a path
    at all, with wider beams.

    Args:
        audio: (n,) float32 in [-1, 1] at 16 kHz.
        words: each word with its pronunciations; the sound chooses among them.
        bounds: start and end in seconds of each word, where they are known (to within ``slack``).
        slack: seconds of sound kept on either side of the spoken part.
        sharp: move edges to where the sound changes (:mod:`dnnvss.speech.align_edges`); for an alignment that a voice
            is learnt from, the aligner's own edges serve.
        lasting: stretches of 10 ms that the spoken part begins and ends with, see :func:`spoken_part`.

    Raises:
        DnnvssError: no word, no sound, less sound than the words need, or speech that drowns in noise.
        UnfitError: words that are not in the sound.
    """
    _check(audio, words)
    if noisy(audio):
        audio = _clear(audio)
    said = " ".join(word for word, _ in words)
    reasons: list[str] = []
    for attempt, (start, end), gain, beam in _attempts(audio, bounds, slack, lasting):
        if beam < _BEAM and set(reasons) != {_NOT_FOUND}:
            break  # a path was found, and it does not fit: others are worse
        sound = audio[int(start * SPEECH_RATE) : int(end * SPEECH_RATE)] * gain
        heard = decode(sound, [ways for _, ways in words], beam)
        if heard is None:
            reasons.append(_NOT_FOUND)
            continue
        why = doubt(heard, words, sound, start)
        if not why:
            pieces = [(h.phone, h.word, h.start + start, h.end + start) for h in heard]
            scores = tuple(score([h for h in heard if h.word == k]) for k in range(len(words)))
            found = tiers(pieces, [word for word, _ in words], len(audio) / SPEECH_RATE)
            return Aligned(sharpened(given_back(found, {}), audio) if sharp else found, scores, attempt)
        reasons.append(why)
    why = next((r for r in reasons if r != _NOT_FOUND), _NOT_FOUND)
    raise UnfitError(f"the text {said!r} {why}",
                remedy="Give the words that were said, all of them, and a recording without noise")


def _check(audio: np.ndarray, words: Sequence[Word]) -> None:
    if not words:
        raise DnnvssError("there is no word to align", remedy="Give the text that was said")
    if mute := [word for word, ways in words if not ways or not all(ways)]:
        raise DnnvssError(f"the word {mute[0]!r} has no phones", remedy="Give its pronunciation")
    least = _LEAST * sum(min(map(len, ways)) for _, ways in words)
    if len(audio) < least * SPEECH_RATE:
        lasts = len(audio) / SPEECH_RATE
        raise DnnvssError(f"the sound lasts {lasts:.2f} s, {len(words)} words need {least:.2f} s at least",
                          remedy="Give the whole recording")
    if not np.isfinite(audio).all() or np.abs(audio).max() < QUIET:
        raise DnnvssError("the sound is silence", remedy="Give a recording with speech, loud enough")


def _clear(audio: np.ndarray) -> np.ndarray:
    """Sound without what is lower than a voice, if speech stands out of the rest."""
    higher = without_rumble(audio)
    if why := noisy(higher):
        raise DnnvssError(why, remedy="Give a recording with less noise")
    return higher


def _attempts(audio: np.ndarray, bounds: Sequence[tuple[float, float]] | None,
              slack: float, lasting: int) -> Iterator[tuple[str, tuple[float, float], float, float]]:
    """Yield the name, the stretch in seconds, the gain and the beam of each attempt."""
    whole = (0.0, len(audio) / SPEECH_RATE)
    spoken = (bounds[0][0], bounds[-1][1]) if bounds else spoken_part(audio, lasting)
    crop = (max(0.0, spoken[0] - slack), min(whole[1], spoken[1] + slack))
    if not crop[1] - crop[0] >= 2 * _LEAST:  # the given times are not of this sound
        crop = whole
    yield "spoken part", crop, 1.0, _BEAM
    yield "whole recording", whole, 1.0, _BEAM
    yield "spoken part at half gain", crop, 0.5, _BEAM
    yield "spoken part with wider beams", crop, 1.0, _WIDE_BEAM
    yield "whole recording with wider beams", whole, 1.0, _WIDE_BEAM


def spoken_part(audio: np.ndarray, lasting: int = 1) -> tuple[float, float]:
    """Return the first and last moment in seconds at which sound (n,) at 16 kHz rises well above its noise floor.

    Args:
        audio: the sound.
        lasting: stretches of 10 ms of which all but one have to: what is shorter is a click or a chair, no speech.
    """
    level = levels(audio)
    floor, peak = np.percentile(level, 10), np.percentile(level, 98)
    loud = (level > floor + 0.35 * (peak - floor)).astype(int)
    at = np.flatnonzero(np.convolve(loud, np.ones(lasting, int)) >= max(lasting - 1, 1))
    if not len(at):
        return 0.0, len(audio) / SPEECH_RATE
    return max(at[0] - lasting + 1, 0) * 0.01, min(at[-1] + 1, len(level)) * 0.01


__all__ = ["DOUBTFUL", "LASTING", "QUIET", "Aligned", "UnfitError", "Word", "align", "spoken_part"]
