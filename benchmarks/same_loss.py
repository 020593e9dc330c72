"""Whether the fast step learns what a plain one does: the static error on the validation frames, over several seeds.

    python -m data_prep corpus=demo corpus.out=CORPUS
    OMP_NUM_THREADS=1 python benchmarks/same_loss.py CORPUS [--seeds 3] [--hidden 512 512 512] [--dropout 0.5]
    python benchmarks/same_loss.py CORPUS --save FILE      # and on another machine, without the corpus:
    python benchmarks/same_loss.py FILE --accelerator gpu

Both fits have the same data, settings and seeds; ``plain`` has torch's own dropout and embedding sum and no recorded
steps, ``ours`` what the package has, in float32 and, where the machine has it, in bf16. The error is in variances of
the training frames.
"""

import argparse
import logging
import pickle
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from claim import Claim, tell
from torch import Tensor, nn

from dnnvss.systems import Example, feedforward
from dnnvss.systems.network import NetworkModel
from dnnvss.timing import FrameClock
from dnnvss.training import FitSettings
from dnnvss.training.precision import has_bf16

Examples = dict[str, list[Example]]
SPREAD = 2.0
"""Standard errors of the difference by which the error may be larger."""


def corpus_examples(folder: Path) -> Examples:
    """Return the examples of a prepared corpus, phones and context."""
    from hydra import compose, initialize_config_dir

    from dnnvss.commands.train_settings import run_settings
    from dnnvss.corpus import Corpus
    from dnnvss.runs.fitting import encode
    from dnnvss.systems.examples import split_examples

    with initialize_config_dir(str(Path(__file__).parents[1] / "conf"), version_base=None):
        config = compose("train", overrides=["corpus=demo", f"corpus.out={folder}", "labels=ph"])
    settings, corpus = run_settings(config), Corpus.open(folder)
    examples = split_examples(settings.task, corpus, encode(settings, corpus), settings.split)
    return {name: [replace(e, targets=e.measured[0].astype(np.float32)) for e in part]
            for name, part in examples.items()}


@contextmanager
def plain() -> Iterator[None]:
    """Replace the parts of the package by those of torch."""
    def embedding_sum(active: Tensor, weight: Tensor) -> Tensor:
        return nn.functional.embedding_bag(active, weight, mode="sum", padding_idx=len(weight) - 1)

    replaced = {"Dropout": nn.Dropout, "code_sum": embedding_sum, "multiplies": lambda weight: False}
    kept = {name: getattr(feedforward, name) for name in replaced}
    vars(feedforward).update(replaced)
    yield
    vars(feedforward).update(kept)


def error(model: NetworkModel, val: list[Example]) -> float:
    """Return the static error of a fitted model."""
    parts = [((model.predict(e).mean[:, 0] - e.targets[:, 0]) / model.deviation_[0])[e.valid]  # type: ignore[index]
             for e in val]
    return float(np.square(np.concatenate(parts)).mean())


def main() -> None:
    """Print a line a way."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", type=Path, metavar="CORPUS", help="folder of a prepared corpus, or a saved FILE")
    parser.add_argument("--save", type=Path, metavar="FILE", help="write the examples of the corpus, and stop")
    parser.add_argument("--accelerator", choices=("cpu", "gpu"), default="cpu")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--epochs", type=int, default=6)
    parser.add_argument("--hidden", type=int, nargs="+", default=[512, 512, 512])
    parser.add_argument("--dropout", type=float, default=0.5)
    arguments = parser.parse_args()
    logging.getLogger("lightning.pytorch").setLevel(logging.WARNING)
    warnings.filterwarnings("ignore")
    given = arguments.source
    examples: Examples = pickle.loads(given.read_bytes()) if given.is_file() else corpus_examples(given)
    if arguments.save:
        arguments.save.write_bytes(pickle.dumps({name: examples[name] for name in ("train", "val")}))
        return
    some = examples["train"][0]
    network = {"kind": "feedforward", "hidden": arguments.hidden, "dropout": arguments.dropout, "input_dropout": 0.2}

    def fit(seed: int, precision: str, graph: bool = True) -> float:
        settings = FitSettings(epochs=arguments.epochs, seed=seed, precision=precision, progress=False, figure_every=0,
                               accelerator=arguments.accelerator, graph=graph)
        model = NetworkModel(some.codes.table, FrameClock(100), NetworkModel.Settings(network, settings))
        with tempfile.TemporaryDirectory() as folder:
            model.fit(examples["train"], examples["val"], Path(folder))
            return error(model, examples["val"])

    bf16 = has_bf16("cpu" if arguments.accelerator == "cpu" else "cuda")
    ways = {"ours, float32": "32-true"} | ({"ours, bf16": "bf16-mixed"} if bf16 else {})
    errors: dict[str, list[float]] = {"plain, float32": [], **{name: [] for name in ways}}
    for seed in range(arguments.seeds):
        with plain():
            errors["plain, float32"].append(fit(seed, "32-true", graph=False))
        for name, precision in ways.items():
            errors[name].append(fit(seed, precision))
        print(f"seed {seed}: " + "; ".join(f"{name} {values[-1]:.4f}" for name, values in errors.items()), flush=True)
    for name, values in errors.items():
        print(f"{name}: {np.mean(values):.4f} +- {np.std(values, ddof=1) if len(values) > 1 else np.nan:.4f}")
    if arguments.seeds > 1:
        tell(claims(errors))


def claims(errors: dict[str, list[float]]) -> list[Claim]:
    """How much larger the error of ours is, in standard errors of the difference over seeds."""
    (_, plain_errors), *others = errors.items()
    return [Claim(f"error of {name}, over torch's own layers, in standard errors",
                  float((np.mean(values) - np.mean(plain_errors))
                        / np.sqrt((np.var(values, ddof=1) + np.var(plain_errors, ddof=1)) / len(values))), SPREAD)
            for name, values in others]


if __name__ == "__main__":
    main()
