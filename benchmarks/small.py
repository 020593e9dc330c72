"""What model=auto is worth on small corpora, each sentence said by systems that neither heard it nor were chosen by it.

    python benchmarks/small.py data/ann data/bob ...
    python benchmarks/small.py data/grid --clips 10 20      parts of a training split instead, drawn by --seed

Sentences are left out in turn. For each part the system is chosen anew, by trials on the sentences that are left, and
fitted on them beside every candidate. The face is fitted once.
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

from dnnvss.commands.conf import conf_folder
from dnnvss.commands.train_settings import run_settings
from dnnvss.corpus import Corpus
from dnnvss.curves import mlpg
from dnnvss.evaluation.choice import AutoSettings, tried
from dnnvss.evaluation.report import Report, evaluate
from dnnvss.evaluation.statistics import difference
from dnnvss.formats.tables import aligned
from dnnvss.runs.fitting import Material, encode, gather
from dnnvss.runs.folds import folded, speech
from dnnvss.runs.knowledge import with_knowledge
from dnnvss.systems import Example
from dnnvss.systems.examples import speech_frames
from dnnvss.systems.registry import make_system


def material(folder: Path, given: list[str], clips: int, seed: int) -> Material:
    """The examples of a corpus, or of some clips of its training split, all of them in ``test``."""
    with initialize_config_dir(str(conf_folder()), version_base="1.3"):
        settings = with_knowledge(run_settings(compose("train", ["corpus=folder", f"corpus.name={folder.name}",
                                                                 "corpus.raw=none", f"corpus.out={folder}", "folds=0",
                                                                 *given])))
    corpus = Corpus.open(folder)
    made = gather(settings, corpus, encode(settings, corpus))
    if clips:
        some = random.Random(seed).sample(sorted(made.examples["train"], key=lambda e: e.id), clips)
        return replace(made, examples={"test": some})
    return replace(made, examples={"test": [e for part in made.examples.values() for e in part]})


def left_out(made: Material) -> tuple[Report, list[str]]:
    """Scores of all candidates and of ``auto``, and what that chose in each part."""
    auto, task = AutoSettings.read(made.settings.model), made.settings.task
    everything = made.examples["test"]
    networks = speech(everything) / 60 >= auto.networks
    names = [name for name, own in auto.candidates.items() if networks or "fit" not in own]
    said: dict[str, dict[str, np.ndarray]] = {name: {} for name in ("auto", *names)}
    chosen = []
    for part in folded(everything, min(len(everything), 10) if len(everything) <= 12 else 5):
        with tempfile.TemporaryDirectory() as scratch:
            heard = [*part["train"], *part["val"]]
            choice = tried(replace(made, examples={"train": heard}), auto, names, Path(scratch) / "choices")
            chosen.append(choice.system)
            for name in names:
                model = make_system(name, auto.candidates[name], task.table, task.clock)
                model.fit(part["train"], part["val"], Path(scratch) / name)
                for e in part["test"]:
                    predicted = model.predict(e)
                    said[name][e.id] = np.asarray(mlpg(predicted.mean, predicted.variance, task.windows))
        said["auto"] |= {e.id: said[choice.system][e.id] for e in part["test"]}
    return scored(said, everything, made), chosen


def scored(said: dict[str, dict[str, np.ndarray]], examples: list[Example], made: Material) -> Report:
    """The scores of what systems said."""
    clock = made.settings.task.clock
    return evaluate(said, {e.id: e.measured[0][:, 0] for e in examples}, valid={e.id: e.measured[1] for e in examples},
                    speech={e.id: speech_frames(e.alignment, clock) for e in examples})


def gain(report: Report, system: str) -> str:
    """How much a system gains over the means of phones, with its interval and p."""
    means, own = [np.stack([np.nan_to_num(v), ~np.isnan(v)], axis=1).astype(float)
                  for v in (report.sentences(name, "correlation") for name in ("phone_mean", system))]
    d = difference(means, own)
    return f"{d.value:+.3f} ({d.low:+.3f} to {d.high:+.3f}), p {d.p:.3f}"


def main() -> None:
    """Print a table of each corpus."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("corpora", nargs="+", type=Path)
    parser.add_argument("--clips", nargs="+", type=int, default=[0], help="of the training split; 0 for all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--set", nargs="*", default=[], help="settings of train.py, such as aam=grid")
    given = parser.parse_args()
    for folder in given.corpora:
        for clips in given.clips:
            made = material(folder, given.set, clips, given.seed)
            report, chosen = left_out(made)
            rows = [[name, f"{report.headline(name):.3f}", f"{report.summary(name, 'rmse')[0]:.1f}",
                     f"{report.summary(name, 'gv_ratio')[0]:.2f}", gain(report, name)] for name in report.scores]
            print(f"\n{folder.name}: {len(made.examples['test'])} sentences, {speech(made.examples['test']):.0f} s of "
                  f"speech; chosen: {', '.join(f'{n} {chosen.count(n)} times' for n in dict.fromkeys(chosen))}")
            print(aligned(["system", "correlation", "RMSE", "GV ratio", "over phone means"], rows), flush=True)


if __name__ == "__main__":
    main()
