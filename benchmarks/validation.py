"""Finished runs on the validation split, where choices are made: correlation, RMSE and GV ratio over speech.

    python benchmarks/validation.py runs/A runs/B ...

In brackets the 95 % bootstrap interval over sentences; the last columns are the difference of each run's correlation
from that of the first, with its interval and p (paired permutation test). Plain MLPG; first five coefficients. Runs of
several frame rates are measured on the finest clock among theirs. Runs have to be of one corpus, split and face.
"""

import argparse
import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from pathlib import Path

import numpy as np

from dnnvss.curves import resample
from dnnvss.evaluation import Report, evaluate
from dnnvss.evaluation.runs import open_corpus
from dnnvss.evaluation.statistics import difference, estimate
from dnnvss.formats.tables import aligned
from dnnvss.runs.corpus_visemes import corpus_units
from dnnvss.runs.fitting import encode
from dnnvss.runs.run import Run
from dnnvss.style.generator import PLAIN
from dnnvss.systems import Example
from dnnvss.systems.examples import make_examples, speech_frames
from dnnvss.systems.viseme_plan import UnitPlan


def validation_examples(run: Run) -> list[Example]:
    """The validation examples of a run, with the dynamic visemes that its headline is measured with."""
    settings = run.settings
    corpus = open_corpus(run.folder, settings.corpus_folder)
    encoded, tiers = encode(settings, corpus), None
    if "visemes" in settings.task.table.sources:
        plan = UnitPlan.from_config(settings.visemes)
        tiers = corpus_units(corpus, encoded, settings.split, settings.task.clock, plan).tiers(plan, [])
    return list(make_examples(settings.task, corpus, corpus.split("val", settings.split), encoded, tiers))


def measured(folders: list[Path]) -> Report:
    """What runs say of the validation sentences against what was measured."""
    runs = {folder.name: Run.open(folder) for folder in folders}
    clock = max((run.task.clock for run in runs.values()), key=lambda own: own.rate)
    said: dict[str, dict[str, np.ndarray]] = {}
    known: list[Example] = []
    for name, run in runs.items():
        examples = validation_examples(run)
        said[name] = {e.id: run.generator(e, PLAIN) for e in examples}
        known = examples if run.task.clock == clock else known
    references = {e.id: e.measured[0][:, 0] for e in known}
    for name, run in runs.items():
        said[name] = {i: resample(said[name][i], run.task.clock, clock, count=len(x)) for i, x in references.items()}
    return evaluate(said, references, speech={e.id: speech_frames(e.alignment, clock) for e in known},
                    valid={e.id: e.measured[1] for e in known})


def main() -> None:
    """Print a line for each run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=Path)
    folders: list[Path] = parser.parse_args().runs
    report = measured(folders)
    pairs = {f.name: np.stack([values := report.sentences(f.name, "correlation"), np.ones_like(values)], 1)
             for f in folders}
    rows = []
    for folder in folders:
        own = estimate(pairs[folder.name])
        row = [folder.name, f"{own.value:.4f} ({own.low:.3f} to {own.high:.3f})",
               *(f"{report.summary(folder.name, metric)[0]:.3f}" for metric in ("rmse", "gv_ratio"))]
        if folder != folders[0]:
            other = difference(pairs[folders[0].name], pairs[folder.name])
            row += [f"{other.value:+.4f} ({other.low:+.4f} to {other.high:+.4f})", f"{other.p:.4f}"]
        rows.append(row + [""] * (6 - len(row)))
    print(aligned(["run", "correlation", "RMSE", "GV ratio", "less the first", "p"], rows))


if __name__ == "__main__":
    main()
