"""What talkers of minutes gain by one training with others, each sentence said by systems that never heard it.

    python benchmarks/talkers.py data/ann data/bob --with data/grid --set aam=grid jobs=1 model=feedforward labels=ph_d

Sentences are left out in turn, a part of every talker at once, and one network with an output for each is fitted on the
others and on the training split of the corpora behind ``--with``. Beside it: the kernel regression of each alone, with
``--knowledge RUN`` the regression from what that run says, and the mean of the joint network with each.
"""

import argparse
import os
import tempfile

os.environ.setdefault("OMP_NUM_THREADS", "1")

from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np
from hydra import compose, initialize_config_dir
from small import material, scored

from dnnvss.commands.conf import conf_folder
from dnnvss.commands.train_settings import run_settings
from dnnvss.corpus import Corpus
from dnnvss.curves import mlpg
from dnnvss.evaluation.report import Report
from dnnvss.evaluation.statistics import difference
from dnnvss.formats.tables import aligned
from dnnvss.runs.fitting import Material, encode, gather
from dnnvss.runs.folds import folded, shuffled, speech
from dnnvss.systems import Example, VisualModel
from dnnvss.systems.registry import make_system, read_system
from dnnvss.systems.talkers import TalkersFit

Said = dict[str, np.ndarray]


def heard(folder: Path, given: list[str], clips: int) -> Material:
    """Training and validation sentences of a talker who is not scored; some of the training sentences alone."""
    with initialize_config_dir(str(conf_folder()), version_base="1.3"):
        settings = run_settings(compose("train", ["corpus=folder", f"corpus.name={folder.name}", "corpus.raw=none",
                                                  f"corpus.out={folder}", "folds=0", *given]))
    corpus = Corpus.open(folder)
    made = gather(settings, corpus, encode(settings, corpus))
    some = shuffled(made.examples["train"])[: clips or None]
    return replace(made, examples={"train": some, "val": made.examples["val"]})


def alone(made: Material, name: str, folds: int) -> Said:
    """The left-out sentences of a talker by a candidate of ``model=auto``."""
    task, said = made.settings.task, Said()
    for part in folded(made.examples["test"], folds):
        model = make_system(name, made.settings.model["candidates"][name], task.table, task.clock)
        with tempfile.TemporaryDirectory() as scratch:
            model.fit(part["train"], part["val"], Path(scratch))
        said |= spoken(model, part["test"], made)
    return said


def together(made: dict[str, Material], others: dict[str, Material], balance: float, folds: int) -> dict[str, Said]:
    """The left-out sentences of each talker by joint networks."""
    first = next(iter(made.values())).settings
    settings = read_system(first.model_name, first.model)[1]
    faces = {name: own.encoded.face for name, own in {**made, **others}.items()}
    fit = TalkersFit(first.task.table, first.task.clock, settings, balance, faces)
    said: dict[str, Said] = {name: {} for name in made}
    dealt = {name: folded(own.examples["test"], folds) for name, own in made.items()}
    for k in range(folds):
        train, val = [{**{name: own[k][kind] for name, own in dealt.items()},
                       **{name: own.examples[kind] for name, own in others.items()}} for kind in ("train", "val")]
        with tempfile.TemporaryDirectory() as scratch:
            models = fit(train, val, Path(scratch))
        for name, own in dealt.items():
            said[name] |= spoken(models[name], own[k]["test"], made[name])
    return said


def spoken(model: VisualModel, test: list[Example], made: Material) -> Said:
    found = {e.id: model.predict(e) for e in test}
    return {i: np.asarray(mlpg(p.mean, p.variance, made.settings.task.windows)) for i, p in found.items()}


def gain(report: Report, system: str, over: str) -> str:
    before, after = (np.stack([np.nan_to_num(v), ~np.isnan(v)], axis=1).astype(float)
                     for v in (report.sentences(name, "correlation") for name in (over, system)))
    d = difference(before, after)
    return f"{d.value:+.3f} ({d.low:+.3f} to {d.high:+.3f}), p {d.p:.3f}"


def main() -> None:
    """Print a table of each corpus."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("corpora", nargs="+", type=Path)
    parser.add_argument("--with", nargs="*", type=Path, default=[], dest="others", help="heard and not scored")
    parser.add_argument("--clips", type=int, default=0, help="of the training split of each of these; 0 for all")
    parser.add_argument("--balance", nargs="+", type=float, default=[0.5])
    parser.add_argument("--folds", type=int, default=5, help="parts of the sentences")
    parser.add_argument("--knowledge", type=Path, help="a run of another talker, with the labels of --set")
    parser.add_argument("--set", nargs="*", default=[], help="settings of train.py, such as aam=grid model=feedforward")
    given = parser.parse_args()
    labels = [own for own in given.set if not own.startswith(("model", "trainer"))]
    made = {folder.name: material(folder, given.set, 0, 0) for folder in given.corpora}
    others = {folder.name: heard(folder, given.set, given.clips) for folder in given.others}
    said: dict[str, dict[str, Said]] = {}
    for folder in given.corpora:
        said[folder.name] = {"kernel": alone(material(folder, labels, 0, 0), "kernel", given.folds)}
        if given.knowledge:
            know = material(folder, [*labels, f"knowledge={given.knowledge}"], 0, 0)
            said[folder.name]["adapted"] = alone(know, "adapted", given.folds)
    for balance in given.balance:
        for name, found in together(made, others, balance, given.folds).items():
            said[name][f"joint {balance:g}"] = found
    for name, own in said.items():
        joint = [system for system in own if system.startswith("joint")]
        means = {f"{one} + {two}": {i: (own[one][i] + own[two][i]) / 2 for i in own[one]}
                 for one in joint for two in own if two not in joint}
        report = scored({**own, **means}, made[name].examples["test"], made[name])
        rows = [[system, f"{report.headline(system):.3f}", f"{report.summary(system, 'gv_ratio')[0]:.2f}",
                 *(gain(report, system, over) for over in ("kernel", "adapted") if over in own)]
                for system in chain(own, means)]
        test = made[name].examples["test"]
        print(f"\n{name}: {len(test)} sentences, {speech(test):.0f} s of speech")
        print(aligned(["system", "correlation", "GV ratio", *(f"over {o}" for o in ("kernel", "adapted") if o in own)],
                      rows), flush=True)


if __name__ == "__main__":
    main()
