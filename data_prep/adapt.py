"""The corpus's own aligner: the talker's phones learnt from the first alignment, and every recording aligned anew."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from data_prep.align import lateness
from data_prep.stages import FOLDER, Workshop, fingerprint
from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats import spanning
from dnnvss.media import SPEECH_RATE, read_audio
from dnnvss.phones import SHORT_PAUSE, SILENCE, SILENCES
from dnnvss.progress import counted
from dnnvss.speech.align_adapt import VERSION, Voice, first_states, learn, segment
from dnnvss.speech.align_features import HOP, cepstra
from dnnvss.speech.align_onset import EXAMPLES, FREE, QUANTILE, given_back, longest, runs_of
from dnnvss.speech.align_tiers import Piece, tiers
from dnnvss.timing import Alignment

ROUNDS = 4
"""Times that the voice is learnt; between them the corpus is segmented with it."""

MIXTURES = 1
"""Gaussians of a state. With four, two first alignments that differ in a twelfth of the clips lead to edges 3.7 ms
apart in the mean; with one, 0.4 ms, and phone starts of synthetic voices are nearer to the truth."""

LEAST = 300.0
"""Seconds of speech below which a voice is not learnt: too few examples of each phone."""

MOST = 3600.0
"""Seconds of recordings that a voice is learnt from, or half as many more; of a longer corpus every so-many-th."""

SLACK = 0.2
"""Seconds by which a word may leave its given times."""

LATE = 0.004
"""Seconds by which edges between the talker's own phones are heard late: the median against the known phone times of
three synthetic voices (300 sentences) was -2, 5 and 9 ms."""

TRUSTED_MEAN, TRUSTED_WORD, TRUSTED_SILENCE = -3.0, -12.0, -6.0
"""Fits of an utterance, of a word and of a silence from which the talker's own voice is believed against the aligner
for everybody."""

_TOGETHER = 32
"""Clips that are segmented side by side."""

Words = list[tuple[str, list[tuple[str, ...]]]]


def learn_voice(
    shop: Workshop, tasks: Mapping[str, dict[str, Any]], first: Mapping[str, dict[str, Any]]
) -> Path | None:
    """Return the file of the talker's voice, learnt from the first alignment; None where there is too little speech.

    Args:
        shop: where to work; the voice is kept and learnt anew when the alignments change.
        tasks: ``words``, ``audio`` and ``bounds`` of each utterance, as the aligner had them.
        first: its results.
    """
    names = sorted(set(tasks) & set(first))
    known = {n: Alignment.from_json(first[n]["alignment"]) for n in names}
    if sum(s.duration for a in known.values() for s in a["phones"] if s.label not in SILENCES) < LEAST:
        return None
    names = names[:: max(1, round(sum(a.end for a in known.values()) / MOST))]
    key = fingerprint(VERSION, ROUNDS, MIXTURES, QUANTILE, FREE, EXAMPLES, [(n, tasks[n], first[n]) for n in names])
    path = shop.out / FOLDER / "voice" / f"{key}.npz"
    if not path.is_file():
        for old in path.parent.glob("*.npz"):
            files.remove(old)
        features = [cepstra(read_audio(tasks[n]["audio"])) for n in counted(names, "cepstra", unit="clips")]
        phones = (*sorted({p for t in tasks.values() for _, ways in t["words"] for way in ways for p in way}), SILENCE)
        own_voice(phones, features, [known[n] for n in names], [tasks[n] for n in names]).write(path)
    return path


def own_voice(phones: tuple[str, ...], features: list[np.ndarray], known: list[Alignment],
              tasks: list[dict[str, Any]]) -> Voice:
    """Return the voice learnt from a first alignment in :data:`ROUNDS` rounds.

    Args:
        phones: of the voice, silence among them.
        features: cepstra (T, 39) of each clip.
        known: the first alignment of each clip.
        tasks: ``words`` and ``bounds`` (or nothing) of each clip.
    """
    limits = longest([runs_of(a) for a in known])
    states = [first_states(_pieces(given_back(a, limits)), len(f), phones)
              for a, f in zip(known, features, strict=True)]
    voice = learn(features, states, phones, MIXTURES)
    for _ in counted(range(1, ROUNDS), "voice", unit="rounds"):
        for k in range(0, len(features), _TOGETHER):
            part = slice(k, k + _TOGETHER)
            sentences = [[w for _, w in t["words"]] for t in tasks[part]]
            bounds = [t["bounds"] or None for t in tasks[part]]
            states[part] = [s for _, s, _ in segment(voice, features[part], sentences, bounds, SLACK)]
        voice = learn(features, states, phones, MIXTURES)
    return voice


def _pieces(alignment: Alignment) -> list[Piece]:
    labels = {SHORT_PAUSE: SILENCE}
    return [(labels.get(s.label, s.label), -1, s.start, s.end) for s in alignment["phones"]]


@dataclass(frozen=True)
class Hearing:
    """What the talker's own voice hears in a recording.

    Args:
        pieces: phones and silences in turn.
        fits: of each word, the mean over its frames of the log likelihood of its state less that of the best state: 0
            where nothing would fit better.
        silence: the least fit of a silence of 0.1 s or more, 0 where there is none.
    """

    pieces: tuple[Piece, ...]
    fits: tuple[float, ...]
    silence: float

    @property
    def trusted(self) -> bool:
        """Whether the words fit so well that a refusal by the aligner for everybody does not count."""
        return bool(np.mean(self.fits) >= TRUSTED_MEAN and min(self.fits) >= TRUSTED_WORD
                    and self.silence >= TRUSTED_SILENCE)

    def tiers(self, words: Sequence[str], duration: float) -> Alignment:
        """Return the tiers ``phones`` and ``words`` of a recording of that many seconds."""
        return tiers([(phone, word, max(a - LATE, 0.0), b - LATE) for phone, word, a, b in self.pieces], words,
                     duration)


def hear(voice: Voice, sound: np.ndarray, words: Words, bounds: list[tuple[float, float]] | None = None) -> Hearing:
    """Return what a voice hears in sound (n,) at 16 kHz in which these words were said."""
    [(pieces, _, fit)] = segment(voice, [cepstra(sound)], [[ways for _, ways in words]], [bounds], SLACK)
    spans = [(phone, word, slice(round(a / HOP), round(b / HOP))) for phone, word, a, b in pieces]
    owner = np.full(len(fit), -1)
    for _, word, span in spans:
        owner[span] = word
    silences = [float(fit[s].mean()) for _, word, s in spans if word < 0 and s.stop - s.start >= 0.1 / HOP]
    fits = tuple(round(float(fit[owner == k].mean()), 2) for k in range(len(words)))
    return Hearing(tuple(pieces), fits, min(silences, default=0.0))


def heard_again(name: str, out: Path, voice: str, audio: Path, words: Words, bounds: list[tuple[float, float]],
                frames: int, rate: str, scores: list[float], attempt: str) -> dict[str, Any]:
    """Return the alignment by the talker's own voice, as plain containers, with the fit of each word.

    Args:
        name: the utterance id.
        out: the prepared corpus.
        voice: file of the voice, relative to ``out``.
        audio: the sound.
        words: each word with its pronunciations.
        bounds: start and end of each word in seconds, or nothing where they are not known.
        frames, rate: of the video; the alignment ends where it ends.
        scores, attempt: of the first alignment; they are kept.
    """
    del name
    sound = read_audio(audio)
    found = hear(Voice.read(out / voice), sound, words, bounds or None)
    return _result(found, words, len(sound) / SPEECH_RATE, bounds, float(frames / Fraction(rate)), scores, attempt)


def heard_at_last(name: str, out: Path, refused: str, voice: str, audio: Path, words: Words,
                  bounds: list[tuple[float, float]], frames: int, rate: str) -> dict[str, Any]:
    """Return what :func:`heard_again` does, of an utterance that the aligner for everybody refused.

    Args:
        name, out, voice, audio, words, bounds, frames, rate: as there.
        refused: why it was refused.

    Raises:
        DnnvssError: the talker's own voice does not trust these words either, or never spoke their phones.
    """
    sound, own = read_audio(audio), Voice.read(out / voice)
    words = [(word, [way for way in ways if set(way) <= set(own.phones)]) for word, ways in words]
    if new := [word for word, ways in words if not ways]:
        raise DnnvssError(f"{refused}; its word {new[0]!r} has phones of its own", utterance=name,
                          remedy="Give the words that were said, all of them, and a recording without noise")
    found = hear(own, sound, words, bounds or None)
    if not found.trusted:
        raise DnnvssError(f"{refused}; by the talker's own voice neither (fit {np.mean(found.fits):.1f}, worst word "
                          f"{min(found.fits):.1f}, worst silence {found.silence:.1f})", utterance=name,
                          remedy="Give the words that were said, all of them, and a recording without noise")
    duration = float(frames / Fraction(rate))
    return _result(found, words, len(sound) / SPEECH_RATE, bounds, duration, [], "the talker's own voice")


def _result(found: Hearing, words: Words, heard: float, bounds: list[tuple[float, float]], duration: float,
            scores: list[float], attempt: str) -> dict[str, Any]:
    whole = spanning(found.tiers([w for w, _ in words], heard), duration)
    return {"alignment": whole.to_json(), "scores": scores, "attempt": attempt, "fit": list(found.fits),
            "late": lateness(whole, bounds)}
