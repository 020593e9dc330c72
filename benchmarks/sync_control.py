"""Is putting sound and picture in step real, or does it fit the noise of the test clips?

The lag of each test clip is estimated from its first half alone, and the run is scored on the second half, which that
estimate has not seen. Beside it: the clips as distributed, and the lag that the preparation took from the whole clip.

    python benchmarks/sync_control.py --corpus data/grid --run runs/NAME
"""

import argparse
from pathlib import Path

import numpy as np

from data_prep import sync
from data_prep.stages import FOLDER, Workshop
from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.corpus import Corpus
from dnnvss.runs.files import RunFiles

FIRST = 5
"""Leading coefficients that the correlation averages over."""


def main() -> None:
    """Print the correlation over the second halves of the test sentences, mean and standard deviation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--corpus", type=Path, default=Path("data/grid"))
    parser.add_argument("--run", type=Path, required=True)
    arguments = parser.parse_args()
    corpus = Corpus.open(arguments.corpus)
    kept = sorted((arguments.corpus / FOLDER / "sync").glob("*.json"), key=lambda p: p.stat().st_mtime)
    taken = files.read_json(kept[-1], "Prepare the corpus with corpus.importer.sync=true")["late"]
    first = _first_halves(corpus)
    arrays = {name: read_arrays(RunFiles(arguments.run).prediction(name))
              for name in ("predicted", "reference", "speech")}
    rate = 100.0
    scores: dict[str, list[float]] = {"as distributed": [], "by the first half": [], "by the whole clip": []}
    for name, predicted in arrays["predicted"].items():
        spoken = np.flatnonzero(arrays["speech"][name])
        half = spoken[len(spoken) // 2 :]
        for row, late in zip(scores.values(), (0.0, first[name], taken[name]), strict=True):
            moved = _moved(predicted, (taken[name] - late) * rate)
            row.append(_correlation(moved[half], arrays["reference"][name][half]))
    print("correlation over the second halves of the sentences")
    for system, values in scores.items():
        print(f"{system:20} {np.mean(values):.3f} ({np.std(values):.3f})")


def _first_halves(corpus: Corpus) -> dict[str, float]:
    """Return how late each clip's sound is as its first half tells, shrunk by what the halves disagree."""
    names = sorted(corpus.utterances)
    sounds = {n: f"{FOLDER}/sound/{n}.wav" for n in names}
    seen = {n: corpus.landmarks(corpus.utterances[n]) for n in names}
    clips = sync.read_clips(Workshop(corpus.root, jobs=1), sounds, seen, corpus.info.landmark_groups,
                            float(corpus.utterances[names[0]].rate))
    _, first, second = sync.lags(clips, sync.crossfitted(clips))
    first, second = first - np.median(first), second - np.median(second)
    share = max(0.0, 1 - (first - second).var() / 2 / first.var())
    return dict(zip(clips, np.where(np.abs(first) < sync.REACH - sync.HOP, share * first, 0.0), strict=True))


def _moved(trajectory: np.ndarray, frames: float) -> np.ndarray:
    """Return a trajectory (T, D) ``frames`` frames later, held at the ends."""
    t = np.arange(len(trajectory))
    return np.stack([np.interp(t - frames, t, x) for x in trajectory.T[:FIRST].astype(float)], axis=1)


def _correlation(predicted: np.ndarray, reference: np.ndarray) -> float:
    return float(np.mean([np.corrcoef(predicted[:, d], reference[:, d])[0, 1] for d in range(FIRST)]))


if __name__ == "__main__":
    main()
