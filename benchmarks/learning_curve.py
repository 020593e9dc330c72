"""What a talker's own clips are worth: the kernel regression fitted on ever more of them, by the validation split.

    OMP_NUM_THREADS=1 python benchmarks/learning_curve.py data/grid --set aam=grid jobs=1 --clips 10 20 40 80 160

Parts of ten and twenty clips are drawn several times (--draws); the face is that of the whole training split.
"""

import argparse
import os
import random
import tempfile

os.environ.setdefault("OMP_NUM_THREADS", "1")

from dataclasses import replace
from pathlib import Path

import numpy as np
from hydra import compose, initialize_config_dir
from small import scored

from dnnvss.commands.conf import conf_folder
from dnnvss.commands.train_settings import run_settings
from dnnvss.corpus import Corpus
from dnnvss.curves import mlpg
from dnnvss.runs.fitting import Material, encode, gather
from dnnvss.runs.folds import speech
from dnnvss.systems import Example
from dnnvss.systems.registry import make_system

SMALL = 20
"""Clips up to which parts are drawn several times."""


def gathered(folder: Path, given: list[str]) -> Material:
    """The examples of a corpus, with the system of ``model=kernel`` unless another is named."""
    with initialize_config_dir(str(conf_folder()), version_base="1.3"):
        settings = run_settings(compose("train", ["corpus=folder", f"corpus.name={folder.name}", "corpus.raw=none",
                                                  f"corpus.out={folder}", "folds=0", "model=kernel", *given]))
    corpus = Corpus.open(folder)
    return gather(settings, corpus, encode(settings, corpus))


def correlation(made: Material, train: list[Example]) -> float:
    """What the system is worth on the validation split when it is fitted on some examples."""
    task, test = made.settings.task, made.examples["val"]
    model = make_system(made.settings.model_name, made.settings.model, task.table, task.clock)
    with tempfile.TemporaryDirectory() as scratch:
        model.fit(train[1:], train[:1], Path(scratch))
    said = {e.id: model.predict(e) for e in test}
    drawn = {i: np.asarray(mlpg(p.mean, p.variance, task.windows)) for i, p in said.items()}
    return float(scored({"it": drawn}, test, replace(made, examples={"test": test})).summary("it", "correlation")[0])


def main() -> None:
    """Print a line for each number of clips."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("corpus", type=Path)
    parser.add_argument("--clips", type=int, nargs="+", default=[10, 20, 40, 80, 160, 320])
    parser.add_argument("--draws", type=int, default=3)
    parser.add_argument("--set", nargs="*", default=[], help="settings of train.py, such as aam=grid")
    given = parser.parse_args()
    made = gathered(given.corpus, given.set)
    known = sorted(made.examples["train"], key=lambda e: e.id)
    for clips in given.clips:
        parts = [random.Random(seed).sample(known, clips) for seed in range(given.draws if clips <= SMALL else 1)]
        values = [correlation(made, part) for part in parts]
        seconds = np.mean([speech(part) for part in parts])
        low, high = min(values), max(values)
        print(f"{clips} clips, {seconds:.0f} s of speech: {np.mean(values):.3f} ({low:.3f} to {high:.3f})", flush=True)


if __name__ == "__main__":
    main()
