"""Forced alignment that says how sure it is."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.phones import SHORT_PAUSE, SILENCE
from dnnvss.speech.align_sphinx import CENTRE, RATE, STEP, Heard, Pronunciations, decode
from dnnvss.timing import Alignment, Segment, Tier

Word = tuple[str, Pronunciations]

REFUSED = -40.0
"""Mean log score a frame below which the text is taken not to be what was said."""

PAUSE = 0.05
"""Seconds that a silence between two words must last to be a pause of its own."""


@dataclass(frozen=True)
class Aligned:
    """Phones and words on the time line of a recording, and how sure they are.

    Args:
        alignment: tiers ``phones`` and ``words`` from 0 to the end of the sound.
        scores: mean log score a frame of each word, in the order of the words; about -13 where all is well.
        attempt: which of the attempts succeeded, in words.
    """

    alignment: Alignment
    scores: tuple[float, ...]
    attempt: str


def align(audio: np.ndarray, words: Sequence[Word], bounds: Sequence[tuple[float, float]] | None = None,
          slack: float = 0.25) -> Aligned:
    """Return the phones and words of a recording, in time.

    Each attempt is two passes of pocketsphinx over a stretch of the sound; the first one that finds all words with a
    credible score is taken.

    Args:
        audio: (n,) float32 in [-1, 1] at 16 kHz.
        words: each word with its pronunciations, best first; the sound chooses among them.
        bounds: start and end in seconds of each word, where they are known (to within ``slack``).
        slack: seconds of sound kept on either side of the spoken part.

    Raises:
        DnnvssError: no word, no sound, or no attempt found these words in it.
    """
    if not words:
        raise DnnvssError("there is no word to align", remedy="Give the text that was said")
    duration = len(audio) / RATE
    best = -np.inf
    for attempt, (start, end), gain, beam in _attempts(audio, bounds, slack):
        stretch = audio[int(start * RATE): int(end * RATE)] * gain
        heard = decode(stretch, [w[1] for w in words], beam)
        if heard is None:
            continue
        scores = _scores(heard, len(words))
        mean = float(np.average(scores, weights=[_length(heard, k) for k in range(len(words))]))
        best = max(best, mean)
        if mean >= REFUSED:
            heard = _repaired([h._replace(start=h.start + start, end=h.end + start) for h in heard], bounds)
            return Aligned(_alignment(heard, [w[0] for w in words], duration), tuple(scores), attempt)
    said = " ".join(w[0] for w in words)
    why = "was not found in the sound" if not np.isfinite(best) else f"fits the sound badly ({best:.0f} a frame)"
    raise DnnvssError(f"the text {said!r} {why}", remedy="Give the words that were said, or a clearer recording")


def _attempts(audio: np.ndarray, bounds: Sequence[tuple[float, float]] | None, slack: float) -> list:
    whole = (0.0, len(audio) / RATE)
    spoken = (bounds[0][0], bounds[-1][1]) if bounds else spoken_part(audio)
    crop = (max(0.0, spoken[0] - slack), min(whole[1], spoken[1] + slack))
    return [
        ("spoken part", crop, 1.0, 1e-80),
        ("whole recording", whole, 1.0, 1e-80),
        ("half gain", crop, 0.5, 1e-80),
        ("wider beams", crop, 1.0, 1e-200),
        ("wider beams, whole recording", whole, 1.0, 1e-200),
    ]


def spoken_part(audio: np.ndarray) -> tuple[float, float]:
    """Return the first and last moment in seconds at which sound (n,) at 16 kHz rises well above its noise floor."""
    hop = RATE // 100
    frames = audio[: len(audio) // hop * hop].reshape(-1, hop).astype(float)
    level = 10 * np.log10((frames**2).mean(axis=1) + 1e-10)
    floor, peak = np.percentile(level, 10), np.percentile(level, 98)
    loud = np.flatnonzero(level > floor + 0.35 * (peak - floor))
    return (loud[0] * 0.01, (loud[-1] + 1) * 0.01) if len(loud) else (0.0, len(audio) / RATE)


def _length(heard: Sequence[Heard], word: int) -> int:
    return round(sum(h.end - h.start for h in heard if h.word == word) / STEP)


def _scores(heard: Sequence[Heard], count: int) -> list[float]:
    return [sum(h.score for h in heard if h.word == k) / max(_length(heard, k), 1) for k in range(count)]


def _repaired(heard: list[Heard], bounds: Sequence[tuple[float, float]] | None) -> list[Heard]:
    """Return the phones with a first one that begins no sooner than 80 ms before its word is said to begin."""
    if bounds is None:
        return heard
    first = next(k for k, h in enumerate(heard) if h.word == 0)
    earliest = min(bounds[0][0] - 0.08, heard[first].end - 0.03)
    if heard[first].start < earliest:
        heard[first] = heard[first]._replace(start=earliest)
        if first:
            heard[first - 1] = heard[first - 1]._replace(end=earliest)
    return heard


def _alignment(heard: Sequence[Heard], words: Sequence[str], duration: float) -> Alignment:
    """Return the tiers: silence at both ends, short pauses inside, silences too short for a pause shared out."""
    spoken = [h for h in heard if h.word >= 0]
    rows: list[tuple[Segment, int]] = [(Segment(0.0, spoken[0].start, SILENCE), -1)]
    for phone in spoken:
        gap = phone.start - rows[-1][0].end
        if gap >= PAUSE:
            rows.append((Segment(rows[-1][0].end, phone.start, SHORT_PAUSE), -1))
        elif gap > 0:
            last, word = rows[-1]
            rows[-1] = (last._replace(end=last.end + gap / 2), word)
        rows.append((Segment(rows[-1][0].end, phone.end, phone.phone), phone.word))
    if duration - rows[-1][0].end > STEP / 2:
        rows.append((Segment(rows[-1][0].end, duration, SILENCE), -1))
    else:
        rows[-1] = (rows[-1][0]._replace(end=duration), rows[-1][1])
    spans: list[tuple[float, float, str]] = []
    for k, (segment, word) in enumerate(rows):
        if k and word == rows[k - 1][1] and word >= 0:
            spans[-1] = (spans[-1][0], segment.end, spans[-1][2])
        else:
            spans.append((segment.start, segment.end, words[word] if word >= 0 else ""))
    return Alignment([Tier("phones", [s for s, _ in rows]), Tier("words", spans)])


__all__ = ["CENTRE", "PAUSE", "REFUSED", "Aligned", "align", "spoken_part"]
