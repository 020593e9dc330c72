"""What each step of trajectory generation does to a finished run: articulation, closures, contacts, rest, streaming.

    python benchmarks/generation.py RUN

Prints, for the test split, correlation and global-variance ratio of the first five coefficients over speech, closure
recall and precision on p b m, contact on f v, and motion in silence, for plain MLPG and for each step, and the distance
of the streaming form from the offline one. What the steps need to know of the talker is learnt from the training split,
the model's own variance from the validation split.
"""

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss.corpus import Corpus
from dnnvss.curves import GlobalVariance, Stream, Windows, mlpg, smoothing_spline, with_global_variance
from dnnvss.evaluation.bench import Bench
from dnnvss.evaluation.cells import number
from dnnvss.evaluation.comparison import Comparison, compare
from dnnvss.evaluation.metrics import global_variance_ratio
from dnnvss.evaluation.runs import make_bench, not_learnt, read_run
from dnnvss.formats.tables import aligned
from dnnvss.runs.run import Run
from dnnvss.style.generation import Style, generate
from dnnvss.style.talker import Talker
from dnnvss.systems import Example, Prediction
from dnnvss.timing import FrameClock

METRICS = ("correlation", "gv_ratio", "landmarks", "closure_recall", "closure_precision", "closure_onset",
           "contact_recall", "silence", "jerk", "high_power")
STYLES = {
    "rest": Style(rest=True),
    "dial 1": Style(articulation=1.0),
    "closures": Style(closures=True),
    "closures, contacts": Style(closures=True, contacts=True),
    "dial 1, closures, contacts, rest": Style(articulation=1.0, closures=True, contacts=True, rest=True),
}
GV_WEIGHTS = (0.1, 1.0, 10.0)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    folder = parser.parse_args().run
    run, data = Run.open(folder), read_run(folder)
    tested = list(data.arrays["reference"])
    if not_learnt(tested, Corpus.open(data.corpus), run.settings.split) != tested:
        parser.error(f"{folder} left its sentences out in turn and has learnt from all of them: train it with folds=0")
    bench = make_bench([data])
    assert bench.face is not None
    clock, windows = run.task.clock, run.task.windows
    training, validation = load(folder, run, "train"), load(folder, run, "val")
    talker = Talker.of([e.measured[0][:, 0] for e in training], tiers(training), clock, bench.face)
    held_out = [mlpg(p.mean, p.variance, windows) for p in predictions(run, validation)]
    talker = talker.knowing(held_out, [e.measured[0][:, 0] for e in validation], tiers(validation), clock)
    test = load(folder, run, "test")
    predicted = dict(zip([e.id for e in test], predictions(run, test), strict=True))
    table, spent = styles(run, test, predicted, talker, training)
    result = compare(bench, table)
    show(result, spent)
    print("\nglobal-variance ratio of each of the first five coefficients, mean over the sentences")
    print(aligned(["", *"12345"], [[name, *ratios(bench, own)] for name, own in table.items()]))
    streaming(predicted, windows, clock)


def load(folder: Path, run: Run, split: str) -> list[Example]:
    """Return the examples of a split with their measured trajectories."""
    from dnnvss.face.encoding import find_encoding

    corpus = Corpus.open(read_run(folder).corpus)
    encoded = find_encoding(corpus, run.files.face)
    assert encoded is not None
    found = [u for u in corpus.split(split, run.settings.split) if u.id not in encoded.dropped]
    clips = {u.id: encoded.clip(u.id) for u in found}
    return [run.task.example(u, clips[u.id].parameters, clips[u.id].valid) for u in found]


def tiers(examples: list[Example]) -> list:
    """Return the phones tier of each example."""
    return [e.alignment["phones"] for e in examples]


def predictions(run: Run, examples: list[Example]) -> list[Prediction]:
    """Return the model's prediction of each example."""
    return [run.model.predict(e) for e in examples]


def styles(run: Run, test: list[Example], predicted: dict[str, Prediction], talker: Talker,
           training: list[Example]) -> tuple[dict[str, dict[str, np.ndarray]], dict[str, float]]:
    """Return the trajectories of every way of generating them, and the milliseconds that a sentence took."""
    clock, windows = run.task.clock, run.task.windows
    table: dict[str, dict[str, np.ndarray]] = {}
    spent: dict[str, float] = {}

    def add(name: str, make: Callable[..., Any]) -> None:
        start = time.perf_counter()
        table[name] = {e.id: np.asarray(make(e, predicted[e.id])) for e in test}
        spent[name] = 1000 * (time.perf_counter() - start) / len(test)

    add("plain MLPG", lambda e, p: mlpg(p.mean, p.variance, windows))
    add("no MLPG: static means", lambda e, p: p.mean[:, 0])
    add("static means, smoothing spline 8 Hz", lambda e, p: smoothing_spline(p.mean[:, 0], clock, 8.0))
    for name, style in STYLES.items():
        add(name, lambda e, p, s=style: generate(p.mean, p.variance, e.alignment["phones"], clock, talker, s, windows))
    gv = GlobalVariance.of([e.measured[0][:, 0] for e in training])
    for weight in GV_WEIGHTS:
        add(f"global-variance term, weight {weight:g}",
            lambda e, p, w=weight: with_global_variance(mlpg(p.mean, p.variance, windows), p.variance, gv, w, windows))
    return table, spent


def show(result: Comparison, spent: dict[str, float]) -> None:
    """Print the table, with the milliseconds that a sentence took."""
    rows = [[s, *[number(result.estimate(s, m).value) for m in METRICS], f"{spent[s]:.1f}" if s in spent else ""]
            for s in result.pairs]
    print(aligned(["", *METRICS, "ms"], rows))


def ratios(bench: Bench, own: dict[str, np.ndarray]) -> list[str]:
    """Return the global-variance ratio of the first five coefficients over speech."""
    values = [global_variance_ratio(s.reference[s.spoken, :5], own[s.id][s.spoken, :5]) for s in bench.sentences]
    return [number(v) for v in np.mean(values, axis=0)]


def streaming(predicted: dict[str, Prediction], windows: Windows, clock: FrameClock) -> None:
    """Print how far fixed-lag streaming is from the offline result, in standard deviations of each coefficient."""
    print("\nstreaming: distance from offline in standard deviations of the offline trajectory, first five")
    rows = []
    for lag in (8, 12, 16, 19, 24):
        each = []
        for p in list(predicted.values())[:20]:
            offline = mlpg(p.mean.astype(float), p.variance, windows)
            stream = Stream(offline.shape[1], lag, windows)
            online = np.concatenate([stream.push(p.mean, p.variance), stream.finish()])
            each.append(np.abs(online - offline)[:, :5] / offline.std(axis=0)[:5])
        apart = np.concatenate(each)
        rows.append([f"lag {lag}", f"{1000 * (lag + 1) / float(clock.rate):.0f}", f"{np.sqrt((apart**2).mean()):.4f}",
                     f"{np.quantile(apart, 0.99):.4f}", f"{apart.max():.4f}"])
    print(aligned(["", "first output after (ms)", "rms", "99 %", "max"], rows))


if __name__ == "__main__":
    main()
