"""Whether words can be what was said in a recording, judged by how well they fit it.

All limits lie between what was measured on sound that belongs to its text (900 clips of GRID, 100 sentences of four
synthetic voices, see docs/results/timing.md) and on sound that does not.
"""

from collections.abc import Sequence

import numpy as np

from dnnvss.media import SPEECH_RATE
from dnnvss.speech.align_sphinx import EDGE, STEP, Heard, free_scores

Word = tuple[str, Sequence[tuple[str, ...]]]
"""A word as it is to be written in the tier, and its pronunciations, best first."""

WORDS_BELOW, WORD_BELOW, SILENCE_BELOW = -55.0, -110.0, -45.0
"""Log scores a frame below which words are not what was said: the mean over all words, one word, one silence.

Right words have means from -30 to -8 (eSpeak NG's voices down to -52), worst words down to -92, worst silences of some
length down to -37. Sentences of other words that are found at all have means from -52, speech that the text leaves out
gives silences from -90 to -38."""

_PAUSE, _SHORT = 0.1, 0.16
"""Seconds from which a silence is judged: where the words are doubtful, and where they fit. Stops and pauses of some
voices sound for 0.15 s; a word that the text leaves out takes 0.19 s and more."""

DOUBTFUL = -30.0
"""Mean log score a frame below which the sound is compared with the phones that fit it best, whatever they are; also
the score of a word that may be wrong in an alignment that is accepted."""

_BEHIND, _FAR_BEHIND = -28.0, -31.0
"""By how much doubtful words may lag behind the best phones in the mean, in log score a frame: where one word lags by
more than :data:`_WORD_HINT`, and at all."""

_WORD_HINT, _WORD_BEHIND = -50.0, -83.0
"""By how much one doubtful word may lag: where the mean is behind too, and at all. Right words that are behind
have -45 and more in one of the attempts, of the words of another sentence one has -51 or less."""

_PHONE_BEHIND, _SHARE_BEHIND, _LAGGING = -40.0, 0.4, -18.0
"""A phone lags if it is behind by more than the first number; doubtful words are wrong if more than the second, a share
of their phones, lag and their mean is behind by more than the third."""

_RANGE = 14.0
"""Decibels between the loudest and the quietest parts of a recording below which it is noise: clean ones have 19 and
more, with white noise as strong as the speech (0 dB) they have 5 to 12."""


def levels(audio: np.ndarray) -> np.ndarray:
    """Return the level in decibels of every 10 ms of sound (n,) at 16 kHz."""
    hop = SPEECH_RATE // 100
    steady = float(audio.mean()) if len(audio) else 0.0  # an offset of the sound card is no sound
    frames = audio[: len(audio) // hop * hop].reshape(-1, hop).astype(float) - steady
    return np.asarray(10 * np.log10((frames**2).mean(axis=1) + 1e-10))


def noisy(audio: np.ndarray) -> str:
    """Return why sound (n,) cannot be speech that stands out of its noise, or nothing."""
    low, high = np.percentile(levels(audio), [10, 98])
    if high - low < _RANGE:
        return f"the sound is noise, or speech that drowns in it: its parts differ by {high - low:.0f} dB in level"
    return ""


def without_rumble(audio: np.ndarray) -> np.ndarray:
    """Sound (n,) at 16 kHz without what is lower than a voice: offsets that drift, rumble, the hum of mains."""
    from scipy.signal import butter, sosfiltfilt  # slow to import

    low = butter(4, _LOWEST, "highpass", fs=SPEECH_RATE, output="sos")
    return np.asarray(sosfiltfilt(low, audio.astype(float)), np.float32)


_LOWEST = 80.0
"""Hertz below which there is next to nothing of a voice."""


def doubt(heard: Sequence[Heard], words: Sequence[Word], audio: np.ndarray, start: float) -> str:
    """Return why the words cannot be what was said, or nothing.

    Args:
        heard: what was found in the sound; times count from its beginning.
        words: the words of the text.
        audio: the stretch of the recording (n,) that was searched.
        start: seconds in the recording at which it begins, for the message.
    """
    spoken = [h for h in heard if h.word >= 0]
    mean = score(spoken)
    if mean < WORDS_BELOW or (mean < DOUBTFUL and _behind(spoken, len(words), audio)):
        return f"does not fit the sound (score {mean:.0f} a frame)"
    for index, (word, _) in enumerate(words):
        own = score([h for h in spoken if h.word == index])
        if own < WORD_BELOW:
            return f"does not fit the sound at the word {word!r} (score {own:.0f} a frame)"
    shortest = _PAUSE if mean < DOUBTFUL else _SHORT
    for pause in heard:
        if pause.word < 0 and pause.end - pause.start > shortest and score([pause]) < SILENCE_BELOW:
            return f"leaves out what is said from {start + pause.start:.2f} to {start + pause.end:.2f} s"
    return ""


def _behind(spoken: Sequence[Heard], words: int, audio: np.ndarray) -> bool:
    """Return whether other phones fit the sound so much better that the words cannot be right."""
    free = np.concatenate([[0.0], np.cumsum(free_scores(audio))])
    edges = [[round((t - EDGE) / STEP) for t in (h.start, h.end)] for h in spoken]
    frames = np.array([b - a for a, b in edges])
    lag = np.array([h.score - (free[b] - free[a]) for h, (a, b) in zip(spoken, edges, strict=True)])
    owner = np.array([h.word for h in spoken])
    word_lag = np.bincount(owner, lag, words) / np.bincount(owner, frames, words)
    mean, share, word = lag.sum() / frames.sum(), (lag / frames < _PHONE_BEHIND).mean(), word_lag.min()
    return bool(mean < _FAR_BEHIND or word < _WORD_BEHIND or (mean < _BEHIND and word < _WORD_HINT)
                or (mean < _LAGGING and share > _SHARE_BEHIND))


def score(heard: Sequence[Heard]) -> float:
    """Return the mean log score a frame; 0 is as good as can be."""
    return sum(h.score for h in heard) / max(round(sum(h.end - h.start for h in heard) / STEP), 1)
