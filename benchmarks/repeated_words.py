"""How alike a talker's face is when it says the same words again: what words and their times can tell at most.

    python benchmarks/repeated_words.py runs/A runs/B --words 3 --split val

Recordings that begin with the same words, two at a time: the one is laid over the other phone by phone, and the first
five coefficients over these words are correlated. If a rendition is what its words ask for, and something of its own,
two of them correlate by ``r = s / (s + v)``, and the best guess from words and times with any of them by ``sqrt(r)``.
Beside it stands what each run says of these words in the sentences of a split, plain parameter generation.
"""

import argparse
import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from collections import defaultdict
from itertools import combinations
from pathlib import Path

import numpy as np

from dnnvss.corpus import Corpus, Utterance
from dnnvss.curves import mlpg, resample
from dnnvss.evaluation.metrics import correlation
from dnnvss.face.encoding import EncodedCorpus
from dnnvss.runs.fitting import encode
from dnnvss.runs.run import Run
from dnnvss.timing import FrameClock

FIRST = 5
"""Coefficients that count."""


def rendition(encoded: EncodedCorpus, utterance: Utterance, words: int, clock: FrameClock) -> tuple[
        tuple[str, ...], np.ndarray, np.ndarray]:
    """The phones of the first words, their edges (P + 1,) in frames, and the coefficients (T, 5) of the utterance."""
    tier, spoken = utterance.alignment["phones"], utterance.alignment["words"]
    said = [k for k, word in enumerate(spoken.labels) if word][:words]
    start, end = spoken.edges[said[0]], spoken.edges[said[-1] + 1]
    inside = [k for k, middle in enumerate(tier.middles) if start < middle < end]
    edges = tier.edges[inside[0] : inside[-1] + 2] * float(clock.rate)
    rows = resample(encoded.clip(utterance.id).parameters, utterance.clock, clock)[:, :FIRST]
    return tuple(tier.labels[k] for k in inside), edges, rows


def alike(one: tuple[np.ndarray, np.ndarray], other: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """The correlation (5,) of two renditions, each its edges and rows, the second laid over the first."""
    (edges, own), (theirs, rows) = one, other
    frames = np.arange(np.ceil(edges[0]), np.floor(edges[-1])).astype(int)
    places = np.clip(np.interp(frames + 0.5, edges, theirs) - 0.5, 0, len(rows) - 1)
    laid = np.stack([np.interp(places, np.arange(len(rows)), column) for column in rows.T], axis=1)
    return correlation(own[frames], laid)


def said(run: Run, corpus: Corpus, encoded: EncodedCorpus, split: str, words: int) -> np.ndarray:
    """The correlation (sentences, 5) of what a run says of the first words of sentences."""
    found = []
    for utterance in corpus.split(split, run.settings.split):
        if utterance.id not in encoded.dropped and encoded.clip(utterance.id).valid.all():
            _, edges, rows = rendition(encoded, utterance, words, run.task.clock)
            told = run.model.predict(run.recorded(corpus, utterance))
            made = np.asarray(mlpg(told.mean, told.variance, run.task.windows))[:, :FIRST]
            found.append(alike((edges, rows), (edges, made)))
    return np.array(found)


def main() -> None:
    """Print the correlations."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--split", default="val")
    parser.add_argument("--words", type=int, default=3, help="at the start, that two recordings share")
    options = parser.parse_args()
    runs = [Run.open(folder) for folder in options.runs]
    run = runs[0]
    corpus = Corpus.open(run.settings.corpus_folder)
    encoded, groups = encode(run.settings, corpus), defaultdict(list)
    for utterance in corpus.utterances.values():
        if utterance.id not in encoded.dropped and encoded.clip(utterance.id).valid.all():
            words = tuple(w for w in utterance.alignment["words"].labels if w)[: options.words]
            phones, edges, rows = rendition(encoded, utterance, options.words, run.task.clock)
            groups[words, phones].append((edges, rows))
    found = np.array([alike(*pair) for group in groups.values() for pair in combinations(group, 2)])
    each = found.mean(axis=0)
    print(f"{len(found)} pairs of {sum(len(g) > 1 for g in groups.values())} beginnings of {options.words} words")
    print(f"two renditions: {each.mean():.3f}, coefficient by coefficient {np.round(each, 3).tolist()}")
    print(f"a best guess with one: {np.sqrt(each).mean():.3f}, {np.round(np.sqrt(each), 3).tolist()}")
    for own in runs:
        each = said(own, corpus, encoded, options.split, options.words).mean(axis=0)
        print(f"{own.folder.name}: {each.mean():.3f}, {np.round(each, 3).tolist()}")


if __name__ == "__main__":
    main()
