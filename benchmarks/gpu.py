"""Training at the paper's size on one GPU: seconds an epoch of 14 hours, and the share of the GPU's matrix products.

    python benchmarks/gpu.py                       5 x 3000 tanh, dropout .5, 5,040,000 frames, batch 100 and 4096

Codes and targets (2 GB) lie on the GPU, which draws its batches by itself; the fit is that of train.py. Some
seconds of each batch size are measured and an epoch follows from them. Each line below is the same fit with one thing
done otherwise; the last of them is the dense pipeline of nnmnkwii and Merlin on the same GPU (memory-mapped float32
features, a DataLoader, torch's own layers). Then come the two ways to the first layer, sum of rows and one-hot matrix
expanded on the GPU, and eight small networks, one after the other and as one network of stacked matrices.
``--frames 20000 --hidden 64 64 --device cpu`` tries the program without a GPU.
"""

import argparse
import copy
import logging
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from lightning.pytorch.callbacks import Callback
from synthetic import all_features, synthetic_store
from torch.utils.data import DataLoader
from training import (
    Job,
    bare_trainer,
    drawn,
    fit_module,
    new_network,
    ours,
    peer,
    product_rate,
    random_targets,
)

from dnnvss.features import CodeStore, FeatureTable
from dnnvss.systems import feedforward
from dnnvss.systems.stacked import StackedNetworks
from dnnvss.training.batches import Blocks, FrameBatches
from dnnvss.training.precision import has_bf16

DENSE_FRAMES = 12_000  # of the peer's file
SMALL, COPIES, SMALL_BATCH = [512, 512, 512], 8, 512


@contextmanager
def rows_summed() -> Iterator[None]:
    """Let networks sum rows in their first layer where they would multiply."""
    kept, feedforward.multiplies = feedforward.multiplies, lambda *given: False
    yield
    feedforward.multiplies = kept


def milliseconds(function: Callable[[], object], device: str, repeats: int = 10) -> float:
    """Return the least time of a call."""
    times = []
    for _ in range(repeats + 2):
        start = time.perf_counter()
        function()
        if device == "cuda":
            torch.cuda.synchronize()
        times.append(time.perf_counter() - start)
    return 1e3 * min(times[2:])


def first_layer(store: CodeStore, batch: int, units: int, device: str, bf16: bool) -> tuple[float, float]:
    """Return milliseconds, forward and backward, of the first layer as a sum of rows and as a dense product."""
    frames = np.random.default_rng(0).integers(0, len(store), batch)
    active, numeric = (torch.as_tensor(part).to(device) for part in (store.active(frames), store.numeric(frames)))
    layer = feedforward.CodeLinear(store.table.binary_width, store.table.numeric_width, units).to(device)

    def both() -> None:
        layer.zero_grad()
        with torch.autocast(device, torch.bfloat16, enabled=bf16):
            layer(active, numeric).float().square().sum().backward()

    product = milliseconds(both, device)
    with rows_summed():
        return milliseconds(both, device), product


class Epochs(Callback):
    """Keeps the seconds of each epoch, from the drawing of its order to its last step."""

    def __init__(self) -> None:
        self.seconds: list[float] = []

    def on_train_epoch_start(self, *rest: object) -> None:
        self.start = time.perf_counter()

    def on_train_epoch_end(self, *rest: object) -> None:
        torch.cuda.synchronize()
        self.seconds.append(time.perf_counter() - self.start)


def whole_epoch(job: Job, batches: FrameBatches, table: FeatureTable, precision: str) -> float:
    """Return the seconds of the second of two epochs."""
    module = fit_module(job, new_network(job, table))
    epochs = Epochs()
    bare_trainer(job, precision, epochs, 2).fit(module, DataLoader(Blocks(batches), batch_size=None))
    return epochs.seconds[1]


def stacked(table: FeatureTable, batches: FrameBatches, device: str, precision: str) -> None:
    """Print what a step of several small networks takes, one after the other and together."""
    job = Job(SMALL, SMALL_BATCH, "adamw", 0.0, device)
    small = copy.copy(batches)
    small.batch_size = SMALL_BATCH
    alone = ours(job, small, new_network(job, table), precision)()
    small.members = COPIES
    together = ours(job, small, StackedNetworks([new_network(job, table) for _ in range(COPIES)]), precision)()
    print(f"{COPIES} networks of {' x '.join(map(str, SMALL))}, batch {SMALL_BATCH}: one after the other "
          f"{1e3 * COPIES * alone:.2f} ms a step, together {1e3 * together:.2f} ms", flush=True)


def main() -> None:
    """Print a table a batch size, then the two ways to the first layer, then small networks."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hidden", type=int, nargs="+", default=[3000] * 5)
    parser.add_argument("--batches", type=int, nargs="+", default=[100, 4096])
    parser.add_argument("--frames", type=int, default=5_040_000)
    parser.add_argument("--device", choices=("cuda", "cpu"), default="cuda")
    arguments = parser.parse_args()
    warnings.filterwarnings("ignore")
    logging.getLogger("lightning.pytorch").setLevel(logging.WARNING)
    if arguments.device == "cuda" and not torch.cuda.is_available():
        raise SystemExit("no GPU here; --device cpu tries the program")
    name = torch.cuda.get_device_name() if arguments.device == "cuda" else "the processor"
    store, bf16 = synthetic_store(all_features(), arguments.frames), has_bf16(arguments.device)
    dtype, precision = (torch.bfloat16, "bf16-mixed") if bf16 else (torch.float32, "32-true")
    targets = random_targets(len(store))
    print(f"{name}, torch {torch.__version__}: {' x '.join(map(str, arguments.hidden))}, {len(store):,} frames, "
          f"{precision}", flush=True)
    every = drawn(Job(arguments.hidden, arguments.batches[0], "sgd", 0.5, arguments.device), store, targets)
    with tempfile.TemporaryDirectory() as folder:
        for batch in arguments.batches:
            job = Job(arguments.hidden, batch, "sgd", 0.5, arguments.device)
            batches = copy.copy(every)
            batches.batch_size = batch
            rate = 1 / product_rate(job, dtype)()

            def line(way: str, step: float, rate: float = rate, job: Job = job) -> None:
                share = job.products * job.batch / 1e12 / rate / step
                print(f"batch {job.batch}, {way}: {1e3 * step:.2f} ms a step, {len(store) / job.batch * step:.1f} s an "
                      f"epoch, {100 * share:.0f} % of {rate:.0f} TFLOP/s", flush=True)

            def fit(job: Job = job, precision: str = precision, batches: FrameBatches = batches) -> float:
                return ours(job, batches, new_network(job, store.table), precision)()

            line("as train.py does it", fit())
            line("launched by the host, no graph", fit(replace(job, graph=False)))
            with rows_summed():
                line("first layer as a sum of rows", fit())
            line("float32", fit(precision="32-true"))
            if arguments.device == "cuda":
                line("torch.compile within the graph", fit(replace(job, compile=True)))
                if batch == max(arguments.batches):
                    seconds = whole_epoch(job, batches, store.table, precision)
                    print(f"batch {batch}, as train.py does it: a whole epoch took {seconds:.1f} s", flush=True)
            dense = synthetic_store(all_features(), DENSE_FRAMES)
            line("dense pipeline, float32", peer(job, dense, random_targets(len(dense)), Path(folder))())
            summed, product = first_layer(store, batch, arguments.hidden[0], arguments.device, bf16)
            print(f"batch {batch}, first layer: sum of rows {summed:.2f} ms, dense product {product:.2f} ms")
    stacked(store.table, every, arguments.device, precision)


if __name__ == "__main__":
    main()
