"""How long each system takes to say a sentence: from codes of labels to the trajectory, the run already loaded.

    python benchmarks/systems.py runs/A runs/B ...
"""

import argparse
import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import time
from pathlib import Path

import numpy as np

from dnnvss.corpus import Utterance
from dnnvss.curves import mlpg
from dnnvss.runs.run import Run
from dnnvss.timing import Alignment, FrameClock, Tier

REPEATS = 20
PHONES = ("sil", "P", "L", "EY", "S", "R", "EH", "D", "AE", "T", "JH", "IY", "N", "AY", "N", "N", "AW", "B", "IH", "N",
          "B", "L", "UW", "AE", "T", "sil")


def sentence(seconds: float) -> Alignment:
    """Return an alignment of even phones, one word."""
    edges = np.linspace(0, seconds, len(PHONES) + 1)
    rows = list(zip(edges[:-1], edges[1:], PHONES, strict=True))
    return Alignment([Tier("phones", rows),
                      Tier("words", [(0, edges[1], ""), (edges[1], edges[-2], "word"), (edges[-2], edges[-1], "")])])


def main() -> None:
    """Print the median time of each run's system for a sentence of three seconds."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--seconds", type=float, default=3.0)
    arguments = parser.parse_args()
    print(f"{'run':44} {'prediction':>12} {'and MLPG':>10}   (ms, median of {REPEATS}, one core)")
    for folder in arguments.runs:
        run = Run.open(folder)
        example = run.task.example(Utterance("timing", "word", sentence(arguments.seconds), rate=FrameClock(25).rate))
        alone, whole = [], []
        for _ in range(REPEATS):
            start = time.perf_counter()
            prediction = run.model.predict(example)
            middle = time.perf_counter()
            mlpg(prediction.mean, prediction.variance, run.task.windows)
            alone.append(middle - start)
            whole.append(time.perf_counter() - start)
        print(f"{folder.name:44} {1000 * np.median(alone):12.1f} {1000 * np.median(whole):10.1f}")


if __name__ == "__main__":
    main()
