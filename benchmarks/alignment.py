"""Forced alignment against known truth: synthetic speech, whose phone times the engine gives.

    python benchmarks/alignment.py                      # every engine that is installed, 100 sentences
    python benchmarks/alignment.py --refusals 30        # and what must be refused, made of the first 30

Each engine speaks the sentences in a voice and a time of its own (the formant voice in the durations of the built-in
talker); the aligner gets the sound, the words and the pronunciations of the lexicon. An error is the distance between
the start of a phone as heard and as spoken, first by the aligner for everybody, then by the engine's own voice learnt
from all its sentences, as a corpus is aligned (``data_prep``), which also decides about sentences that the first one
refused; where the sound chose another pronunciation, the phones
that the two share count, in order. The sentences are read from a file in which a row holds category, variant and text.

What must be refused: the words of the next sentence (mismatched), the first half of the sound (truncated), white noise
as strong as the speech (0 dB), no sound (empty) and zeros (silent).
"""

import argparse
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from difflib import SequenceMatcher
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import resample_poly
from tqdm import tqdm

from data_prep.adapt import Hearing, hear, own_voice
from dnnvss.corpus import Utterance
from dnnvss.corpus.talker.durations import speak
from dnnvss.corpus.talker.grammar import compose
from dnnvss.errors import DnnvssError
from dnnvss.media import SPEECH_RATE
from dnnvss.phones import SILENCE, SILENCES
from dnnvss.speech.align import UnfitError, Word, align
from dnnvss.speech.align_adapt import Voice
from dnnvss.speech.align_edges import sharpened
from dnnvss.speech.align_features import cepstra
from dnnvss.speech.durations import DurationModel
from dnnvss.speech.engines import ENGINES, find_engine
from dnnvss.text.score import read_cases
from dnnvss.text.sentence import Sentence, parse
from dnnvss.timing import Alignment, Segment

SENTENCES = Path(__file__).parents[1] / "tests" / "text" / "data" / "heldout.tsv"


class Spoken(NamedTuple):
    """Sound (n,) at 16 kHz, what was said in it and when, and the words as the aligner gets them."""

    sound: np.ndarray
    truth: Alignment
    words: list[Word]


def spoken_by(name: str, sentences: Sequence[Sentence]) -> Iterator[Spoken]:
    """Yield each sentence as the engine speaks it."""
    engine = find_engine(name)
    durations = _talker_durations() if name == "formant" else None
    for sentence in sentences:
        speech = engine.speak(sentence, durations.predict(sentence) if durations else None)
        sound = resample_poly(speech.samples, SPEECH_RATE, speech.rate).astype(np.float32)
        yield Spoken(sound, speech.alignment, [(w.spoken, w.choices()) for w in sentence.words])


def _talker_durations() -> DurationModel:
    random = np.random.default_rng(0)
    return DurationModel.fit([Utterance(str(k), text, speak(text, random)) for k, text in enumerate(compose(60))])


def errors(found: Alignment, truth: Alignment) -> tuple[np.ndarray, int]:
    """Return heard less true start (n,) in seconds of the phones that both have, and the number of true phones."""
    heard, said = _phones(found), _phones(truth)
    matcher = SequenceMatcher(None, [s.label for s in heard], [s.label for s in said], autojunk=False)
    pairs = [(heard[a + k], said[b + k]) for a, b, n in matcher.get_matching_blocks() for k in range(n)]
    return np.array([h.start - s.start for h, s in pairs]), len(said)


def _phones(alignment: Alignment) -> list[Segment]:
    return [s for s in alignment["phones"] if s.label not in SILENCES]


def accuracy(engine: str, cases: Sequence[Spoken]) -> tuple[list[str], Voice]:
    """Return the engine's rows of the table, the aligner for everybody and the engine's own voice, and that voice."""
    first, found = dict[int, Alignment](), dict[int, Alignment]()
    for k, case in enumerate(tqdm(cases, engine, leave=False)):
        try:
            first[k] = align(case.sound, case.words, sharp=False).alignment
            found[k] = sharpened(first[k], case.sound)
        except DnnvssError as error:
            print(f"  unaligned: {error.problem}")
    voice = voice_of(cases, first)
    again = {}
    for k, case in enumerate(tqdm(cases, f"{engine}, own voice", leave=False)):
        heard = hear(voice, case.sound, case.words)
        if k in first or heard.trusted:
            again[k] = heard.tiers([w for w, _ in case.words], len(case.sound) / SPEECH_RATE)
        else:
            print(f"  unaligned by the own voice: {_fits(heard)}")
    return [_row(engine, found, cases), _row(f"{engine}, own voice", again, cases)], voice


def _fits(heard: Hearing) -> str:
    return f"fit {np.mean(heard.fits):.1f}, worst word {min(heard.fits):.1f}, worst silence {heard.silence:.1f}"


def _row(name: str, found: Mapping[int, Alignment], cases: Sequence[Spoken]) -> str:
    pairs = [errors(a, cases[k].truth) for k, a in found.items()]
    late = 1000 * np.concatenate([d for d, _ in pairs])
    far, compared = 100 * (np.abs(late) > 25).mean(), 100 * len(late) / sum(n for _, n in pairs)
    return (f"| {name} | {len(cases)} | {len(cases) - len(found)} | {np.abs(late).mean():.1f} | {np.median(late):+.1f} "
            f"| {far:.1f} | {compared:.1f} |")


def voice_of(cases: Sequence[Spoken], first: Mapping[int, Alignment]) -> Voice:
    """Return the voice that is learnt from the first alignment of those cases that have one."""
    features = [cepstra(cases[k].sound) for k in first]
    tasks: list[dict[str, Any]] = [{"words": cases[k].words, "bounds": None} for k in first]
    phones = (*sorted({p for case in cases for _, ways in case.words for way in ways for p in way}), SILENCE)
    return own_voice(phones, features, list(first.values()), tasks)


def _noisy(sound: np.ndarray) -> np.ndarray:
    power = np.sqrt((sound**2).mean())
    return (sound + np.random.default_rng(0).normal(0, power, len(sound))).astype(np.float32)


SPOILT: dict[str, Callable[[Spoken, Spoken], tuple[np.ndarray, list[Word]]]] = {
    "mismatched": lambda this, other: (this.sound, other.words),
    "truncated": lambda this, other: (this.sound[: len(this.sound) // 2], this.words),
    "0 dB noise": lambda this, other: (_noisy(this.sound), this.words),
    "empty": lambda this, other: (this.sound[:0], this.words),
    "silent": lambda this, other: (np.zeros_like(this.sound), this.words),
}


def refusals(engine: str, cases: Sequence[Spoken], voice: Voice) -> str:
    """Return how many of the spoilt cases of each kind were refused, by the aligner for everybody and in the end.

    In the preparation of a corpus words that do not fit get a second chance with the talker's own voice.
    """
    refused, twice = Counter[str](), Counter[str]()
    for kind, spoil in SPOILT.items():
        pairs = list(zip(cases, [*cases[1:], cases[0]], strict=True))
        for this, other in tqdm(pairs, f"{engine}, {kind}", leave=False):
            sound, words = spoil(this, other)
            try:
                found = align(sound, words, sharp=False)
                print(f"  {kind}, taken for {' '.join(w for w, _ in words)!r}: {np.round(found.scores).tolist()}")
            except UnfitError:
                refused[kind] += 1
                heard = hear(voice, sound, [(word, list(ways)) for word, ways in words])
                twice[kind] += not heard.trusted
                if heard.trusted:
                    print(f"  {kind}, trusted by the own voice: {_fits(heard)}")
            except DnnvssError:
                refused[kind] += 1
                twice[kind] += 1
    return f"| {engine} | " + " | ".join(f"{refused[k]}, {twice[k]} of {len(cases)}" for k in SPOILT) + " |"


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--engines", nargs="+", default=list(ENGINES))
    parser.add_argument("--sentences", type=Path, default=SENTENCES)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--refusals", type=int, default=0, help="sentences that are spoilt in each way")
    chosen = parser.parse_args()
    sentences = [parse(case.text, case.variant) for case in read_cases(chosen.sentences)[: chosen.count]]
    rows, refused = list[str](), list[str]()
    for name in chosen.engines:
        if reason := ENGINES[name]().available():
            print(f"{name} is left out: {reason}")
            continue
        cases = list(spoken_by(name, sentences))
        own, voice = accuracy(name, cases)
        rows += own
        print("\n".join(own), flush=True)
        refused += [refusals(name, cases[: chosen.refusals], voice)] if chosen.refusals else []
    print("\n| engine | sentences | unaligned | mean absolute error, ms | median, ms | over 25 ms, % "
          "| phones compared, % |")
    print("\n".join(["|---|---|---|---|---|---|---|", *rows]))
    if refused:
        print("\n| refused | " + " | ".join(SPOILT) + " |\n" + "\n".join(["|---" * (len(SPOILT) + 1) + "|", *refused]))


if __name__ == "__main__":
    main()
