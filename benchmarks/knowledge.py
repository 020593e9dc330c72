"""What a talker of minutes gains by a run of another talker, each sentence said by systems that never heard it.

    python benchmarks/knowledge.py RUN data/ann data/bob --set aam=grid jobs=1

Sentences are left out in turn. Without: the systems for minutes, on labels of phones. With: ``adapted``, on the labels
and the clock of the run. The face is fitted once. The difference is that to the best of the systems without.
"""

import argparse
import os
import tempfile

os.environ.setdefault("OMP_NUM_THREADS", "1")

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from small import material, scored

from dnnvss.curves import mlpg
from dnnvss.evaluation.report import Report
from dnnvss.evaluation.statistics import difference
from dnnvss.formats.tables import aligned
from dnnvss.runs.fitting import Material
from dnnvss.runs.folds import folded, speech
from dnnvss.runs.settings import RunSettings
from dnnvss.systems.registry import make_system


def left_out(made: Material, names: Sequence[str]) -> Report:
    """The scores of some candidates of ``model=auto``."""
    task, everything = made.settings.task, made.examples["test"]
    said: dict[str, dict[str, np.ndarray]] = {name: {} for name in names}
    for part in folded(everything, min(len(everything), 10) if len(everything) <= 12 else 5):
        for name in names:
            model = make_system(name, made.settings.model["candidates"][name], task.table, task.clock)
            with tempfile.TemporaryDirectory() as scratch:
                model.fit(part["train"], part["val"], Path(scratch))
            for e in part["test"]:
                predicted = model.predict(e)
                said[name][e.id] = np.asarray(mlpg(predicted.mean, predicted.variance, task.windows))
    return scored(said, everything, made)


def main() -> None:
    """Print a table of each corpus."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("corpora", nargs="+", type=Path)
    parser.add_argument("--without", nargs="+", default=["phone_mean", "kernel", "ensemble"])
    parser.add_argument("--set", nargs="*", default=[], help="settings of train.py, such as aam=grid")
    given = parser.parse_args()
    source = RunSettings.load(given.run)
    own = [f"labels={source.labels_name}", f"trajectory.rate={source.trajectory.rate}", f"knowledge={given.run}"]
    for folder in given.corpora:
        without = left_out(made := material(folder, given.set, 0, 0), given.without)
        know = left_out(material(folder, [*given.set, *own], 0, 0), ["adapted"])
        best = max(given.without, key=without.headline)
        before, after = (np.stack([np.nan_to_num(v), ~np.isnan(v)], axis=1).astype(float)
                 for v in (without.sentences(best, "correlation"), know.sentences("adapted", "correlation")))
        d = difference(before, after)
        rows = [[name, *(f"{r.summary(name, m)[0]:.3f}" for m in ("correlation", "gv_ratio"))]
                for r, names in ((without, given.without), (know, ["adapted"])) for name in names]
        test = made.examples["test"]
        print(f"\n{folder.name}: {len(test)} sentences, {speech(test):.0f} s of speech; adapted over {best} "
              f"{d.value:+.3f} ({d.low:+.3f} to {d.high:+.3f}), p {d.p:.3f}")
        print(aligned(["system", "correlation", "GV ratio"], rows), flush=True)


if __name__ == "__main__":
    main()
