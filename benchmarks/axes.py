"""One run's test sentences scored on the axes of faces that learnt from less of the same clips.

    python benchmarks/axes.py RUN [--silence 0 0.3 0.6]

A face's coefficients are the leading axes of what it was fitted to. Clips that hold less silence around their speech
give other axes, and the correlation of the first five is that of other movements, though nothing moves otherwise. The
codes of the training clips are turned to the axes of their frames from so many seconds before speech to as many behind
it; the run's predictions and its references are turned alike and scored anew. Where two of the coefficients vary alike
they change places, so the first six are told beside the first five.
"""

import argparse
from pathlib import Path

import numpy as np

from dnnvss.corpus import Corpus, Utterance
from dnnvss.evaluation.metrics import correlation
from dnnvss.evaluation.runs import RunData, read_run
from dnnvss.face.encoding import EncodedCorpus, find_encoding
from dnnvss.runs.files import RunFiles


def main() -> None:
    """Print the correlation of the first coefficients, and of each of the first six, on each set of axes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("--silence", type=float, nargs="+", default=[0.0, 0.3, 0.6])
    given = parser.parse_args()
    run = read_run(given.run)
    corpus = Corpus.open(run.corpus)
    encoded = find_encoding(corpus, RunFiles(run.folder).face)
    if encoded is None:
        raise SystemExit(f"the encoding that {given.run} was trained on is gone")
    clips = [u for u in corpus.split("train") if u.id not in encoded.dropped]
    print(told("its own axes", scored(run, np.eye(len(encoded.face.names)))))
    for seconds in given.silence:
        rows = np.concatenate([about_speech(encoded, u, seconds) for u in clips])
        turned = np.linalg.eigh(rows.T @ rows)[1][:, ::-1]
        print(told(f"{seconds:g} s about speech, {len(rows) / len(clips):.0f} frames a clip", scored(run, turned)))


def about_speech(encoded: EncodedCorpus, utterance: Utterance, seconds: float) -> np.ndarray:
    """The parameters (n, D) of the valid frames within so many seconds of speech, about their mean."""
    code = encoded.clip(utterance.id)
    words = [s for s in utterance.alignment["words"] if s.label]
    at = (np.arange(len(code.valid)) + 0.5) / float(utterance.rate)
    own = code.parameters[code.valid & (at > words[0].start - seconds) & (at < words[-1].end + seconds)].astype(float)
    return own - own.mean(axis=0) if len(own) else own


def scored(run: RunData, axes: np.ndarray) -> np.ndarray:
    """The mean correlation (D,) of each coefficient over the frames of speech, on turned axes (D, D)."""
    kept = {i: run.arrays["speech"][i].astype(bool) & run.arrays["valid"][i].astype(bool)
            for i in run.arrays["reference"]}
    return np.nanmean([correlation(run.arrays["reference"][i][k] @ axes, run.arrays["predicted"][i][k] @ axes)
                       for i, k in kept.items()], axis=0)


def told(name: str, found: np.ndarray) -> str:
    """A line of numbers."""
    return (f"{name}: {found[:5].mean():.3f} (six: {found[:6].mean():.3f}); "
            f"{' '.join(f'{value:.3f}' for value in found[:6])}")


if __name__ == "__main__":
    main()
