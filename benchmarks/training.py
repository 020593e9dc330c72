"""Frames a second in training: dnnvss, and the dense float32 pipeline that nnmnkwii and Merlin use, in one run.

    python benchmarks/training.py                            3 x 3000 tanh, dropout .5, SGD with momentum, all features
    python benchmarks/training.py --threads 1                the same in seconds of the processor: for a busy machine
    python benchmarks/training.py --hidden 512 512 512 --batches 512 --optimizer adamw --dropout 0

The peer holds every frame as 7,735 float32 numbers in a memory-mapped file, draws them with a DataLoader and trains the
same network with torch's own layers and optimiser. Ours is a whole fit with Lightning: drawing of codes, logging,
clipping. Where the processor has bf16, ours and the peer (by autocast) are measured in it too. They take turns; the
best round counts, which other work on the machine disturbs least. The last column says what share of the rate of
matrix products, measured in the same rounds at the same batch, the products of hidden and output layers reach in the
time of the whole step. Its claims are of the network of the papers.
"""

import argparse
import logging
import tempfile
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import lightning as L
import numpy as np
import torch
from claim import Claim, tell
from lightning.pytorch.callbacks import Callback
from synthetic import all_features, synthetic_store
from torch import Tensor, nn
from torch.utils.data import DataLoader, Dataset

from dnnvss.features import CodeStore, FeatureTable, NumericScaler, expand
from dnnvss.systems.feedforward import FeedForward
from dnnvss.training import FitSettings
from dnnvss.training.batches import Blocks, FrameBatches
from dnnvss.training.module import FitModule
from dnnvss.training.precision import has_bf16
from dnnvss.training.recipe import descent
from dnnvss.training.regression import FrameRegression

FRAMES, STREAMS, DIMENSIONS = 12_000, 3, 30
SECONDS = 4.0  # of a round
DENSE, OURS = "dense pipeline", "ours"
PAPER = [3000, 3000, 3000]
TIMES, SHARE = {100: 3.0, 1024: 6.0}, {1024: 35.0}
"""Claims by batch: ours over the dense float32 pipeline, and percent of the rate of bf16 products."""


def clock() -> float:
    """Return seconds: the processor's if there is one thread, the wall's otherwise."""
    return time.process_time() if torch.get_num_threads() == 1 else time.perf_counter()


@dataclass(frozen=True)
class Job:
    """What is trained."""

    hidden: list[int]
    batch: int
    optimizer: str
    dropout: float
    device: str = "cpu"
    graph: bool = True
    compile: bool = False

    @property
    def settings(self) -> FitSettings:
        return FitSettings(optimizer=self.optimizer, learning_rate=0.1 if self.optimizer == "sgd" else 3e-3,
                           schedule="constant", batch_size=self.batch, share=1.0, stream_weights=(1.0,) * STREAMS,
                           graph=self.graph, compile=self.compile)

    @property
    def products(self) -> float:
        """Floating point operations a frame of the products after the first layer, forward and backward."""
        return 6 * sum(a * b for a, b in pairwise([*self.hidden, STREAMS * DIMENSIONS]))


class Watch(Callback):
    """Ends a fit when its time is over and keeps the time between the starts of its blocks of steps."""

    def __init__(self, seconds: float) -> None:
        self.seconds, self.starts, self.steps = seconds, list[float](), list[int]()

    def on_train_batch_start(self, trainer: L.Trainer, module: L.LightningModule, block: list, index: int) -> None:
        if torch.cuda.is_available():
            torch.cuda.synchronize()
        self.starts.append(clock())
        self.steps.append(len(block))
        if len(self.starts) > 3 and self.starts[-1] - self.starts[0] > self.seconds:
            trainer.should_stop = True

    @property
    def step(self) -> float:
        """Seconds of a typical step, drawing and all else of a block shared out, without the first block."""
        return float(np.median((np.diff(self.starts) / self.steps[:-1])[1:]))


def random_targets(frames: int) -> np.ndarray:
    """Return normalised streams (frames, W x D)."""
    return np.random.default_rng(1).normal(size=(frames, STREAMS * DIMENSIONS)).astype(np.float32)


def drawn(job: Job, store: CodeStore, targets: np.ndarray) -> FrameBatches:
    """Return the batches of a job, drawn on its device."""
    scaler = NumericScaler.fit(store, np.arange(0, len(store), max(1, len(store) // 50_000)))
    batches = FrameBatches(store, scaler, targets, np.arange(len(store), dtype=np.int32), job.batch, seed=0)
    return batches if job.device == "cpu" else batches.to(job.device)


def new_network(job: Job, table: FeatureTable) -> FeedForward:
    """Return the network of a job."""
    return FeedForward(table.binary_width, table.numeric_width, table.active_width, STREAMS * DIMENSIONS, job.hidden,
                       dropout=job.dropout)


def bare_trainer(job: Job, precision: str, callback: Callback, epochs: int = 10**6) -> L.Trainer:
    """Return Lightning's trainer without files and output."""
    return L.Trainer(accelerator="gpu" if job.device == "cuda" else "cpu", devices=1, max_epochs=epochs,
                     precision=precision, callbacks=[callback], logger=False,  # type: ignore[arg-type]
                     enable_checkpointing=False, enable_progress_bar=False, enable_model_summary=False)


def fit_module(job: Job, network: nn.Module) -> FitModule:
    """Return what Lightning trains."""
    recipe = descent(job.settings, getattr(network, "members", 1))
    return FitModule(network, FrameRegression(job.settings, STREAMS, DIMENSIONS), recipe, job.settings)


def ours(job: Job, batches: FrameBatches, network: nn.Module, precision: str = "32-true") -> Callable[[], float]:
    """Return what measures a step of ours, in seconds."""
    module = fit_module(job, network)

    def round_() -> float:
        watch = Watch(SECONDS)
        bare_trainer(job, precision, watch).fit(module, DataLoader(Blocks(batches), batch_size=None))
        return watch.step

    return round_


class DenseFrames(Dataset):
    """Rows of two arrays, one after the other."""

    def __init__(self, inputs: np.ndarray, targets: np.ndarray) -> None:
        self.inputs, self.targets = inputs, targets

    def __len__(self) -> int:
        return len(self.inputs)

    def __getitem__(self, index: int) -> tuple[np.ndarray, np.ndarray]:
        return self.inputs[index], self.targets[index]


def peer(job: Job, store: CodeStore, targets: np.ndarray, folder: Path, bf16: bool = False) -> Callable[[], float]:
    """Return what measures a step of the dense pipeline, in seconds; in bf16 by torch's autocast."""
    path = folder / "dense.npy"
    if not path.exists():
        np.save(path, expand(store))
    inputs = np.load(path, mmap_mode="r+")
    layers: list[nn.Module] = []
    for before, after in pairwise([inputs.shape[1], *job.hidden]):
        layers += [nn.Linear(before, after), nn.Tanh(), nn.Dropout(job.dropout)]
    network = nn.Sequential(*layers, nn.Linear(job.hidden[-1], targets.shape[1])).to(job.device)
    optimizer = (torch.optim.SGD(network.parameters(), 0.1, momentum=0.9) if job.optimizer == "sgd" else
                 torch.optim.AdamW(network.parameters(), 3e-3))

    def step(x: Tensor, y: Tensor) -> None:
        optimizer.zero_grad()
        with torch.autocast(job.device, torch.bfloat16, enabled=bf16):
            predicted = network(x.to(job.device))
        (predicted.float() - y.to(job.device)).square().mean().backward()
        optimizer.step()

    def round_() -> float:
        starts = [clock()]
        while starts[-1] - starts[0] < SECONDS or len(starts) < 5:
            for x, y in DataLoader(DenseFrames(inputs, targets), batch_size=job.batch, shuffle=True, drop_last=True):
                step(x, y)
                starts.append(clock())
                if starts[-1] - starts[0] > SECONDS and len(starts) >= 5:
                    break
        return float(np.median(np.diff(starts)[2:]))

    return round_


def product_rate(job: Job, dtype: torch.dtype) -> Callable[[], float]:
    """Return what measures seconds per 10^12 operations of the best of a layer's three matrix products."""
    wide = max(job.hidden)
    x, g = (torch.randn(job.batch, wide, device=job.device, dtype=dtype) for _ in range(2))
    w, out = (torch.randn(wide, wide, device=job.device, dtype=dtype) for _ in range(2))
    small = torch.empty_like(x)
    ways = [lambda: torch.mm(x, w.T, out=small), lambda: torch.mm(g, w, out=small), lambda: torch.mm(g.T, x, out=out)]

    repeats = 1 if job.device == "cpu" else 100  # asking for a product takes the host as long as it takes the GPU

    def round_() -> float:
        best, until = np.inf, clock() + SECONDS / 3
        while clock() < until or best == np.inf:
            for way in ways:
                start = clock()
                for _ in range(repeats):
                    way()
                if job.device == "cuda":
                    torch.cuda.synchronize()
                best = min(best, (clock() - start) / repeats)
        return best / (2 * job.batch * wide**2 / 1e12)

    return round_


def compare(job: Job, rounds: int, folder: Path) -> list[Claim]:
    """Print one table of a batch size; what is claimed of it."""
    store = synthetic_store(all_features(), FRAMES)
    targets = random_targets(len(store))
    batches = drawn(job, store, targets)
    ways = {f"{DENSE}, float32": peer(job, store, targets, folder),
            f"{OURS}, float32": ours(job, batches, new_network(job, store.table))}
    rates = {"float32": product_rate(job, torch.float32)}
    if has_bf16(job.device):
        rates["bf16"] = product_rate(job, torch.bfloat16)
        ways[f"{DENSE}, bf16"] = peer(job, store, targets, folder, bf16=True)
        ways[f"{OURS}, bf16"] = ours(job, batches, new_network(job, store.table), "bf16-mixed")
    best = {name: min(times) for name, times in
            zip([*ways, *rates], zip(*([way() for way in (*ways.values(), *rates.values())] for _ in range(rounds)),
                                     strict=True), strict=True)}
    first = next(iter(ways))
    print(f"\n{' x '.join(map(str, job.hidden))}, batch {job.batch}, {job.optimizer}, dropout {job.dropout}; matrix "
          "products: " + ", ".join(f"{1 / best[name]:.3f} TFLOP/s in {name}" for name in rates))
    print(f"{'':32}{'ms a step':>11}{'frames/s':>10}{'ratio':>7}{'of the roofline':>17}")
    shares = {name: 100 * job.products * job.batch / 1e12 * best["bf16" if "bf16" in name else "float32"] / best[name]
              for name in ways}
    for name in ways:
        print(f"{name:32}{1e3 * best[name]:11.1f}{job.batch / best[name]:10.0f}{best[first] / best[name]:7.2f}"
              f"{shares[name]:16.0f}%", flush=True)
    return claims(job, best, shares) if job.hidden == PAPER else []


def claims(job: Job, best: dict[str, float], shares: dict[str, float]) -> list[Claim]:
    """What is claimed of a batch size, from seconds of a step and shares of the products by way."""
    title, quick = f"training 3 x 3000, batch {job.batch}", min((w for w in shares if OURS in w), key=best.__getitem__)
    told = [Claim(f"{title}: frames a second, ours over the dense pipeline in float32",
                  best[f"{DENSE}, float32"] / best[quick], TIMES[job.batch], least=True)] if job.batch in TIMES else []
    if f"{DENSE}, bf16" in best:
        told.append(Claim(f"{title}: over the dense pipeline in bf16", best[f"{DENSE}, bf16"] / best[quick], 1.0, True))
        if job.batch in SHARE:
            told.append(Claim(f"{title}: percent of the rate of bf16 products", shares[f"{OURS}, bf16"],
                              SHARE[job.batch], least=True))
    return told


def main() -> None:
    """Print a table for each batch size."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hidden", type=int, nargs="+", default=PAPER)
    parser.add_argument("--batches", type=int, nargs="+", default=[100, 1024])
    parser.add_argument("--optimizer", choices=("sgd", "adamw"), default="sgd")
    parser.add_argument("--dropout", type=float, default=0.5)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--threads", type=int, default=2)
    arguments = parser.parse_args()
    torch.set_num_threads(arguments.threads)
    warnings.filterwarnings("ignore")
    logging.getLogger("lightning.pytorch").setLevel(logging.WARNING)
    with tempfile.TemporaryDirectory() as folder:
        for batch in arguments.batches:
            job = Job(arguments.hidden, batch, arguments.optimizer, arguments.dropout)
            tell(compare(job, arguments.rounds, Path(folder)))


if __name__ == "__main__":
    main()
