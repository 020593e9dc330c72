"""How much of what runs get wrong is the same: what none of them can know bounds all of them.

    python benchmarks/errors_shared.py runs/A runs/B runs/C --split val

Of the first five coefficients over speech, plain parameter generation: the correlation of each run
and of the mean of all; the correlation of each pair's errors, and the correlation that a system
would have which got nothing wrong but what both do; and the share of the talker's movement that the
mean leaves unexplained, by how fast it is. Runs of one corpus, split and face; phone times are those
of the recordings. ``--means`` scores the mean of every choice of the runs.
"""

import argparse
import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import numpy as np

from dnnvss.corpus import Corpus, Utterance
from dnnvss.curves import mlpg, resample
from dnnvss.evaluation.metrics import correlation
from dnnvss.face.encoding import EncodedCorpus
from dnnvss.formats.tables import markdown_table
from dnnvss.runs.fitting import encode
from dnnvss.runs.run import Run
from dnnvss.systems.examples import speech_frames

FIRST = 5
"""Coefficients that count."""
BANDS = (0.0, 1.0, 2.0, 4.0, 8.0)
"""Hz at which bands of movement begin; the last one ends at half the frames a second."""
_POINTS = 1024  # of the Fourier transform


def trajectories(run: Run, corpus: Corpus, utterances: Sequence[Utterance], like: Run) -> list[np.ndarray]:
    """What a run says of each utterance (T, 5), on the clock of another run."""
    found = []
    for utterance in utterances:
        said = run.model.predict(run.recorded(corpus, utterance))
        rows = np.asarray(mlpg(said.mean, said.variance, run.task.windows))[:, :FIRST]
        same = run.task.clock == like.task.clock
        found.append(rows if same else resample(rows, run.task.clock, like.task.clock))
    return found


def measured(encoded: EncodedCorpus, utterance: Utterance, run: Run) -> tuple[np.ndarray, np.ndarray]:
    """The talker's own coefficients (T, 5) on the run's clock, and the measured frames of speech."""
    inside, code = speech_frames(utterance.alignment, run.task.clock), encoded.clip(utterance.id)
    rows = resample(code.parameters, utterance.clock, run.task.clock, count=len(inside))[:, :FIRST]
    source = (run.task.clock.centres(len(inside)) * float(utterance.rate)).astype(int)
    return rows, inside & code.valid[np.minimum(source, len(code.valid) - 1)]


def unexplained(truth: Sequence[np.ndarray], said: Sequence[np.ndarray], rate: float) -> np.ndarray:
    """The power of errors over that of the truth in each of :data:`BANDS`, the mean over coefficients."""
    powers = np.zeros((2, len(BANDS), FIRST))
    band = np.digitize(np.fft.rfftfreq(_POINTS, 1 / rate), BANDS) - 1
    for own, rows in zip(truth, said, strict=True):
        window = np.hanning(len(own))[:, None]
        for k, part in enumerate((rows - own, own)):
            spectrum = np.abs(np.fft.rfft((part - part.mean(0)) * window, _POINTS, axis=0)) ** 2
            np.add.at(powers[k], band, spectrum)
    return (powers[0] / powers[1]).mean(axis=1)


def reach(truth: Sequence[np.ndarray], one: Sequence[np.ndarray], other: Sequence[np.ndarray]) -> float:
    """The correlation of a system whose errors are what two systems have in common, the mean over coefficients.

    Errors are taken as a part that both share and parts of each one's own: the covariance of the
    two is the variance of the shared part. Of a best guess the error is what is left of the truth,
    ``r^2 = 1 - shared / var(truth)``; all within sentences, whose means a correlation does not see.
    """
    known, first, second = (np.concatenate([rows - rows.mean(0) for rows in part]) for part in (
        truth, *([y - t for y, t in zip(said, truth, strict=True)] for said in (one, other))))
    return float(np.sqrt(1 - (first * second).mean(0) / known.var(0)).mean())


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--split", default="val")
    parser.add_argument("--means", action="store_true")
    options = parser.parse_args()
    runs = [Run.open(folder) for folder in options.runs]
    corpus = Corpus.open(runs[0].settings.corpus_folder)
    encoded = encode(runs[0].settings, corpus)
    utterances = [u for u in corpus.split(options.split, runs[0].settings.split) if u.id not in encoded.dropped]
    known = [measured(encoded, u, runs[0]) for u in utterances]
    truth = [rows[at] for rows, at in known]
    said = [[rows[: len(at)][at] for rows, (_, at) in zip(trajectories(run, corpus, utterances, runs[0]), known,
                                                          strict=True)] for run in runs]
    mean = [np.mean(parts, axis=0) for parts in zip(*said, strict=True)]
    names = [folder.name for folder in options.runs]
    scores = [np.mean([correlation(t, y) for t, y in zip(truth, rows, strict=True)]) for rows in (*said, mean)]
    print(markdown_table(("run", "correlation"), [(name, f"{score:.4f}") for name, score in
                                                  zip((*names, "mean of them"), scores, strict=True)]))
    errors = [np.concatenate(rows) - np.concatenate(truth) for rows in said]
    pairs = [(names[a], names[b], f"{np.mean(correlation(errors[a], errors[b])):.3f}",
              f"{reach(truth, said[a], said[b]):.4f}") for a, b in combinations(range(len(runs)), 2)]
    print("", markdown_table(("run", "and", "correlation of errors", "without errors of their own"), pairs), sep="\n")
    if options.means:
        chosen = [k for size in range(2, len(runs) + 1) for k in combinations(range(len(runs)), size)]
        means = [[np.mean(parts, axis=0) for parts in zip(*(said[k] for k in own), strict=True)] for own in chosen]
        rows = [(" + ".join(names[k] for k in own),
                 f"{np.mean([correlation(t, y) for t, y in zip(truth, parts, strict=True)]):.4f}")
                for own, parts in zip(chosen, means, strict=True)]
        print("", markdown_table(("mean of", "correlation"), rows), sep="\n")
    left = unexplained(truth, mean, float(runs[0].task.clock.rate))
    bands = [(f"{low:g} Hz and more", f"{share:.2f}") for low, share in zip(BANDS, left, strict=True)]
    print("", markdown_table(("movement of", "unexplained by the mean"), bands), sep="\n")


if __name__ == "__main__":
    main()
