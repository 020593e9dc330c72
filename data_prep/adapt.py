"""The corpus's own aligner: the talker's phones learnt from the first alignment, and every recording aligned anew."""

from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from data_prep.align import lateness
from data_prep.stages import FOLDER, Workshop, fingerprint
from dnnvss.corpus import read_audio
from dnnvss.formats import spanning
from dnnvss.phones import SHORT_PAUSE, SILENCE, SILENCES
from dnnvss.speech.align_adapt import Voice, first_states, learn, segment
from dnnvss.speech.align_features import cepstra
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
"""Seconds of recordings that a voice is learnt from; of a longer corpus every so many-th."""

SLACK = 0.2
"""Seconds by which a word may leave its given times."""

LATE = 0.004
"""Seconds by which edges between the talker's own phones are heard late: the median against the known phone times of
three synthetic voices (300 sentences) was -2, 5 and 9 ms."""

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
    key = fingerprint(ROUNDS, MIXTURES, [(n, tasks[n], first[n]) for n in names])
    path = shop.out / FOLDER / "voice" / f"{key}.npz"
    if not path.is_file():
        for old in path.parent.glob("*.npz"):
            old.unlink()
        features = [cepstra(read_audio(tasks[n]["audio"])) for n in tqdm(names, desc="cepstra")]
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
        tasks: ``words`` and ``bounds`` (or None) of each clip.
    """
    states = [first_states(_pieces(a), len(f), phones) for a, f in zip(known, features, strict=True)]
    voice = learn(features, states, phones, MIXTURES)
    for _ in tqdm(range(1, ROUNDS), desc="voice"):
        for k in range(0, len(features), _TOGETHER):
            part = slice(k, k + _TOGETHER)
            sentences, bounds = [[w for _, w in t["words"]] for t in tasks[part]], [t["bounds"] for t in tasks[part]]
            states[part] = [s for _, s, _ in segment(voice, features[part], sentences, bounds, SLACK)]
        voice = learn(features, states, phones, MIXTURES)
    return voice


def _pieces(alignment: Alignment) -> list[Piece]:
    labels = {SHORT_PAUSE: SILENCE}
    return [(labels.get(s.label, s.label), -1, s.start, s.end) for s in alignment["phones"]]


def heard_again(name: str, out: Path, voice: str, audio: Path, words: Words, bounds: list[tuple[float, float]],
                frames: int, rate: str, scores: list[float], attempt: str) -> dict[str, Any]:
    """Return the alignment by the talker's own voice, as plain containers, with the fit of each word.

    The fit is the mean over a word's frames of the log likelihood of its state less that of the best state: 0 where
    nothing would fit better.

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
    [(pieces, _, fit)] = segment(Voice.read(out / voice), [cepstra(sound)], [[ways for _, ways in words]],
                                 [bounds or None], SLACK)
    earlier = [(phone, word, max(start - LATE, 0.0), end - LATE) for phone, word, start, end in pieces]
    whole = spanning(tiers(earlier, [w for w, _ in words], len(sound) / 16000), float(frames / Fraction(rate)))
    owner = np.full(len(fit), -1)
    for _, word, start, end in pieces:
        owner[round(start * 200) : round(end * 200)] = word
    fits = [round(float(fit[owner == k].mean()), 2) for k in range(len(words))]
    return {"alignment": whole.to_json(), "scores": scores, "attempt": attempt, "fit": fits,
            "late": lateness(whole, bounds)}
