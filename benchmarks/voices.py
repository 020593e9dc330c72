"""How far each run falls when the voice is another one, or comes through noise, a telephone or music.

    python benchmarks/voices.py runs/A runs/B --corpus data/grid --split val
    python benchmarks/voices.py runs/A runs/B --corpus data/grid --times heard
    python benchmarks/voices.py runs/A runs/B --corpus data/grid --others data/s2 data/s3

The first table is the correlation over speech of the first five coefficients, the mean over the sentences of a split:
each sentence as it was recorded and altered. Phone times, where a run reads them, are those of the clean recording, or
with ``--times heard`` those that the text has in the altered sound, as ``synth.py wav=... text=...`` finds them.
The second is of other talkers, each sentence spoken by the run's face: the correlation over speech of the aperture with
that of the talker's own video.
"""

import argparse
import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from dnnvss.acoustics import alter
from dnnvss.corpus import Corpus, Utterance
from dnnvss.curves import mlpg, resample
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.metrics import correlation
from dnnvss.face.base import APERTURE
from dnnvss.face.encoding import EncodedCorpus
from dnnvss.face.lips import lip_pairs
from dnnvss.formats.tables import markdown_table
from dnnvss.media import Sound
from dnnvss.runs.fitting import encode
from dnnvss.runs.run import Run
from dnnvss.speech.align import LASTING, align
from dnnvss.systems.examples import speech_frames
from dnnvss.text.sentence import parse
from dnnvss.timing import Alignment

FIRST = 5
"""Coefficients that count."""
Alteration = Callable[[np.random.Generator, np.ndarray], np.ndarray]


def conditions(others: list[np.ndarray]) -> Mapping[str, Alteration]:
    """The alterations of a sound by name.

    Args:
        others: recordings that babble is made of.
    """
    return {
        "as recorded": lambda rng, x: x,
        "white 5 dB": lambda rng, x: alter.with_noise(x, alter.white(rng, len(x)), 5),
        "babble 5 dB": lambda rng, x: alter.with_noise(x, alter.babble(rng, len(x), others), 5),
        "telephone": lambda rng, x: alter.telephone(x),
        "music 5 dB": lambda rng, x: alter.with_noise(x, alter.music(rng, len(x)), 5),
        "throat x 1.15": lambda rng, x: alter.another_throat(x, 1.15),
        "throat x 0.87": lambda rng, x: alter.another_throat(x, 0.87),
        "12 dB quieter": lambda rng, x: x / 4,
    }


def trajectory(run: Run, utterance: Utterance, sound: Sound | None) -> np.ndarray:
    """What the run's face does (T, D) to say an utterance, plain parameter generation."""
    predicted = run.model.predict(run.example(utterance, sound))
    return np.asarray(mlpg(predicted.mean, predicted.variance, run.task.windows))


def altered_scores(run: Run, corpus: Corpus, encoded: EncodedCorpus, split: str, some: int, aligned: bool
                   ) -> dict[str, float]:
    """The mean correlation under each condition.

    Args:
        run: that speaks.
        corpus, encoded: that it was trained on.
        split, some: whose sentences, and how many of them; all where 0.
        aligned: whether phones have the times that they have in the altered sound.
    """
    hears = aligned or "sound" in run.task.table.needs
    utterances = [u for u in corpus.split(split, run.settings.split) if u.id not in encoded.dropped][:some or None]
    train = corpus.split("train", run.settings.split)[40:80]  # none of whom training with noise had under others
    ways = conditions([corpus.sound(u).samples for u in train] if hears else [])
    scores = {name: [_one(run, corpus, encoded, u, way if hears else None, aligned) for u in utterances]
              for name, way in list(ways.items())[: None if hears else 1]}
    for name, own in scores.items():
        if lost := sum(np.isnan(own)):
            print(f"{run.folder.name}, {name}: the text was not found in {lost} of {len(own)} sounds, left out")
    return {name: float(np.nanmean(own)) for name, own in scores.items()}


def _one(run: Run, corpus: Corpus, encoded: EncodedCorpus, utterance: Utterance, way: Alteration | None, aligned: bool
         ) -> float:
    """The correlation of one sentence; NaN where its text was not found in the altered sound."""
    sound, told = None, utterance
    if way is not None:
        own = corpus.sound(utterance)
        rng = np.random.default_rng(sum(utterance.id.encode()))
        samples = way(rng, own.samples)
        sound = Sound(samples, own.rate, own.kept if samples is own.samples else None)
        if aligned:
            try:
                told = replace(utterance, alignment=times_in(sound, utterance, run))
            except DnnvssError:
                return float("nan")
    predicted = trajectory(run, told, sound if "sound" in run.task.table.needs else None)
    code = encoded.clip(utterance.id)
    clock, count = run.task.clock, min(len(predicted), utterance.alignment["phones"].frame_edges(run.task.clock)[-1])
    predicted = predicted[:count]
    reference = resample(code.parameters, utterance.clock, clock, count=count)
    nearest = np.minimum((clock.centres(count) * float(utterance.rate)).astype(int), len(code.valid) - 1)
    inside = speech_frames(utterance.alignment, clock)[:count] & code.valid[nearest]
    return float(np.mean(correlation(reference[inside, :FIRST], predicted[inside, :FIRST])))


def times_in(sound: Sound, utterance: Utterance, run: Run) -> Alignment:
    """The times that the words of an utterance have in a sound."""
    words = [(w.spoken, w.choices(run.voice.variant)) for w in parse(utterance.text, variant=run.voice.variant).words]
    return align(np.asarray(sound.samples, np.float32), words, lasting=LASTING).alignment


def other_scores(run: Run, corpus: Corpus) -> list[float]:
    """The correlation of the aperture with that of the talker's own video, a sentence each."""
    return [_aperture_score(run, corpus, u) for u in corpus.utterances.values() if u.landmarks]


def _aperture_score(run: Run, corpus: Corpus, utterance: Utterance) -> float:
    points, valid = corpus.landmarks(utterance)
    rows = np.arange(*corpus.info.landmark_groups["lips_inner"])
    pairs, middle = lip_pairs(points[valid].mean(axis=0), rows)
    upper, lower = pairs[middle]
    own = np.linalg.norm(points[:, lower] - points[:, upper], axis=1)
    sound = corpus.sound(utterance) if "sound" in run.task.table.needs else None
    predicted = run.face.gauges[APERTURE](trajectory(run, utterance, sound))
    shown = resample(predicted[:, None], run.task.clock, utterance.clock, count=len(own))
    inside = speech_frames(utterance.alignment, utterance.clock)[: len(own)]
    inside = np.pad(inside, (0, len(own) - len(inside))) & valid
    return float(correlation(own[inside, None], shown[inside])[0])


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--corpus", type=Path, required=True, help="that the runs were trained on")
    parser.add_argument("--split", default="val")
    parser.add_argument("--some", type=int, default=0, help="sentences of the split; all where 0")
    parser.add_argument("--times", default="recorded", choices=("recorded", "heard"))
    parser.add_argument("--others", type=Path, nargs="*", default=[], help="prepared corpora of other talkers")
    options = parser.parse_args()
    runs, corpus = [Run.open(folder) for folder in options.runs], Corpus.open(options.corpus)
    names = [folder.name for folder in options.runs]
    tables = [altered_scores(run, corpus, encode(run.settings, corpus), options.split, options.some,
                             options.times == "heard" and bool(run.needs & {"phones"})) for run in runs]
    rows = [(name, *(f"{table[c]:.3f}" if c in table else "" for c in conditions([])))
            for name, table in zip(names, tables, strict=True)]
    print(markdown_table(("run", *conditions([])), rows))
    if options.others:
        others = [Corpus.open(folder) for folder in options.others]
        rows = []
        for name, run in zip(names, runs, strict=True):
            scores = [other_scores(run, other) for other in others]
            rows.append((name, *(f"{np.mean(s):.3f}" for s in scores), f"{np.mean(np.concatenate(scores)):.3f}"))
        print()
        print(markdown_table(("run", *(c.info.name for c in others), "all sentences"), rows))


if __name__ == "__main__":
    main()
