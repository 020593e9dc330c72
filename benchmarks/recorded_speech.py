"""Speech joined from recordings: whether an aligner hears the words where they are planned, and how loudness goes on.

``OMP_NUM_THREADS=1 python benchmarks/recorded_speech.py runs/RUN --sentences 10`` says sentences of the test split
with ``speech=corpus``, by a run of fragments.
"""

import argparse
from pathlib import Path

import numpy as np

from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.media import SPEECH_RATE
from dnnvss.phones import SILENCES
from dnnvss.runs.run import Run
from dnnvss.speech.align import align
from dnnvss.synthesis.request import CORPUS, SpeakRequest
from dnnvss.synthesis.speak import Spoken, speak
from dnnvss.text.sentence import parse

_AROUND = 0.01
"""Seconds before and after a place, whose loudness is compared."""


def step(samples: np.ndarray, seconds: float) -> float:
    """By how many decibels loudness changes at a place."""
    at, width = round(seconds * SPEECH_RATE), round(_AROUND * SPEECH_RATE)
    before, after = samples[max(at - width, 0) : at], samples[at : at + width]
    return float(abs(20 * np.log10((after.std() + 1e-4) / (before.std() + 1e-4))))


def edges_apart(run: Run, spoken: Spoken) -> list[float]:
    """Seconds from each planned edge of a word to where the aligner hears it."""
    assert spoken.plan.sound is not None
    words = [(w.spoken, w.choices(run.voice.variant)) for w in parse(spoken.plan.text, run.voice.variant).words]
    found = align(spoken.plan.sound.heard.samples, words).alignment
    both = [[w for w in a["words"] if w.label] for a in (spoken.plan.alignment, found)]
    return [abs(t - u) for one, two in zip(*both, strict=True)
            for t, u in ((one.start, two.start), (one.end, two.end))]


def joins(spoken: Spoken) -> list[float]:
    """Decibels by which loudness changes in the middles of phones that two recordings share."""
    assert spoken.plan.sound is not None and spoken.plan.phones is not None
    phones = list(spoken.plan.phones)
    shared = [phones[f.unit.last] for f in spoken.plan.fragments[:-1]]
    return [step(spoken.plan.sound.heard.samples, (p.start + p.end) / 2) for p in shared]


def main(run: Run, count: int) -> None:
    """Print the figures."""
    corpus = Corpus.open(run.settings.corpus_folder)
    apart, steps, longer, usual = list[float](), list[float](), list[float](), list[float]()
    refused = 0
    for utterance in corpus.split("test")[:count]:
        spoken = speak(run, SpeakRequest(utterance.text, engine=CORPUS))
        assert spoken.plan.sound is not None
        steps += joins(spoken)
        longer.append(len(spoken.plan.sound.samples) / SPEECH_RATE - len(spoken.movement) / float(spoken.clock.rate))
        samples = corpus.sound(utterance).samples
        usual += [step(samples, (p.start + p.end) / 2) for p in utterance.alignment["phones"]
                  if p.label not in SILENCES]
        try:
            apart += edges_apart(run, spoken)
        except DnnvssError as error:
            refused += 1
            print(f"{utterance.id}: {error}")
    most = 1000 * max(map(abs, longer))
    print(f"{count} sentences, {refused} refused by the aligner; sound and movement differ by {most:.1f} ms at most")
    near = [f"{np.mean(np.array(apart) <= t / 1000 + 1e-9):.0%} within {t} ms" for t in (20, 50, 100)]
    print(f"{len(apart)} edges of words: {', '.join(near)}")
    for name, values in (("joins", steps), ("middles of recorded phones", usual)):
        print(f"{len(values)} {name}: {np.median(values):.1f} dB, 95 % below {np.percentile(values, 95):.1f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("--sentences", type=int, default=10)
    given = parser.parse_args()
    main(Run.open(given.run), given.sentences)
