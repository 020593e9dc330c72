"""Forced alignment against known truth: synthetic speech, whose phone times the engine gives.

    python benchmarks/alignment.py                      # every engine that is installed, 100 sentences
    python benchmarks/alignment.py --refusals 30        # and what must be refused, made of the first 30

Each engine speaks the sentences in a voice and a time of its own (the formant voice in the durations of the built-in
talker); the aligner gets the sound, the words and the pronunciations of the lexicon. An error is the distance between
the start of a phone as heard and as spoken; where the sound chose another pronunciation, the phones that the two share
count, in order. The sentences are read from a file in which a row holds category, variant and text; none of them was
used to set the aligner's constants.

What must be refused: the words of the next sentence (mismatched), the first half of the sound (truncated), white noise
as strong as the speech (0 dB), no sound (empty) and zeros (silent).
"""

import argparse
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from difflib import SequenceMatcher
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.signal import resample_poly
from tqdm import tqdm

from dnnvss.corpus import Utterance
from dnnvss.corpus.talker.durations import speak
from dnnvss.corpus.talker.grammar import compose
from dnnvss.errors import DnnvssError
from dnnvss.phones import SILENCES
from dnnvss.speech.align import Word, align
from dnnvss.speech.align_sphinx import RATE
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
        sound = resample_poly(speech.samples, RATE, speech.rate).astype(np.float32)
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


def accuracy(engine: str, cases: Sequence[Spoken]) -> str:
    """Return the engine's row of the table."""
    found, phones, unaligned = list[np.ndarray](), 0, 0
    for case in tqdm(cases, engine, leave=False):
        try:
            late, count = errors(align(case.sound, case.words).alignment, case.truth)
        except DnnvssError as error:
            unaligned += 1
            print(f"  unaligned: {error.problem}")
            continue
        found.append(late)
        phones += count
    late = 1000 * np.concatenate(found)
    far = 100 * (np.abs(late) > 25).mean()
    return (f"| {engine} | {len(cases)} | {unaligned} | {np.abs(late).mean():.1f} | {np.median(late):+.1f} "
            f"| {far:.1f} | {100 * len(late) / phones:.1f} |")


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


def refusals(engine: str, cases: Sequence[Spoken]) -> str:
    """Return how many of the spoilt cases of each kind were refused."""
    refused: Counter[str] = Counter()
    for kind, spoil in SPOILT.items():
        pairs = list(zip(cases, [*cases[1:], cases[0]], strict=True))
        for this, other in tqdm(pairs, f"{engine}, {kind}", leave=False):
            try:
                found = align(*spoil(this, other))
            except DnnvssError:
                refused[kind] += 1
                continue
            print(f"  {kind}, taken for {' '.join(w for w, _ in this.words)!r}: {np.round(found.scores).tolist()}")
    return f"| {engine} | " + " | ".join(f"{refused[kind]}/{len(cases)}" for kind in SPOILT) + " |"


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
        rows.append(accuracy(name, cases))
        print(rows[-1], flush=True)
        refused += [refusals(name, cases[: chosen.refusals])] if chosen.refusals else []
    print("\n| engine | sentences | unaligned | mean absolute error, ms | median, ms | over 25 ms, % "
          "| phones compared, % |")
    print("\n".join(["|---|---|---|---|---|---|---|", *rows]))
    if refused:
        print("\n| refused | " + " | ".join(SPOILT) + " |\n" + "\n".join(["|---" * (len(SPOILT) + 1) + "|", *refused]))


if __name__ == "__main__":
    main()
