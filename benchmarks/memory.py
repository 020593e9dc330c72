"""Memory and speed of sampling for fourteen hours of corpus: 5,040,000 frames of all phone and viseme features.

    OMP_NUM_THREADS=1 python benchmarks/memory.py [--hours 14]

A child process makes a synthetic store of that size and its normalised targets, and saves both. Then others open them,
mapped from disk, and train the default network and the paper's with Lightning. Printed are the size on disk beside that
of dense float32 features, the time to open, the memory of a process that has the same store open and of those that
train, the share of a step that drawing a batch takes, and the memory of a whole fit as ``train.py`` does it.
"""

import argparse
import logging
import os
import tempfile
import threading
import time
import warnings
from functools import partial
from pathlib import Path

import numpy as np
import torch
from claim import Claim, tell
from synthetic import UTTERANCE, all_features, synthetic_store
from training import DIMENSIONS, STREAMS, Job, drawn, new_network, ours, random_targets

from dnnvss import files
from dnnvss.features import CodeStore
from dnnvss.features.codes import FrameCodes
from dnnvss.phones import SILENCE
from dnnvss.systems import Example
from dnnvss.systems.network import NetworkModel
from dnnvss.timing import Alignment, FrameClock, Tier
from dnnvss.training import FitSettings
from dnnvss.training.batches import FrameBatches

LIMIT = 1000.0
"""MB of its own that a whole fit is to hold at most."""


def make(folder: Path, frames: int) -> None:
    """Write the store and, in parts, the targets."""
    store = synthetic_store(all_features(), frames)
    store.save(folder / "codes")
    shape = (len(store), STREAMS * DIMENSIONS)
    targets = np.lib.format.open_memmap(folder / "targets.npy", "w+", np.float32, shape)
    for start in range(0, len(store), 100_000):
        targets[start : start + 100_000] = random_targets(min(100_000, len(store) - start))


def resident() -> dict[str, float]:
    """Return MB of memory that the process holds: its own, and pages of mapped files that others can share."""
    lines = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return {name: int(lines[key].split()[0]) / 1024 for name, key in
            (("own", "RssAnon"), ("mapped files", "RssFile"))}


def child(work: "partial[None]") -> None:
    """Run in a process of its own, so that its memory does not count in this one."""
    if (pid := os.fork()) == 0:
        work()
        os._exit(0)
    os.waitpid(pid, 0)


def opened(folder: Path, report: bool) -> CodeStore:
    """Return the store and print how long opening took, or what memory it costs a process."""
    before, start = resident(), time.process_time()
    store = CodeStore.open(folder / "codes")
    if report:
        print(f"opened in {1e3 * (time.process_time() - start):.1f} ms of the processor")
        return store
    rng, active = np.random.default_rng(0), 0
    for _ in range(200):
        active += len(store.active(rng.integers(0, len(store), 4096)))
    after = resident()
    print(f"a second process that has drawn {active:,} frames: own memory {after['own'] - before['own']:+.0f} MB, "
          f"shared pages {after['mapped files'] - before['mapped files']:+.0f} MB", flush=True)
    return store


def drawing(batches: FrameBatches) -> float:
    """Return processor seconds to draw a batch, the order of the epoch included."""
    start = time.process_time()
    blocks = batches.blocks(batches.at_once)
    next(blocks)
    order = time.process_time() - start
    times = []
    for _ in range(30):
        start = time.process_time()
        block = next(blocks)
        times.append((time.process_time() - start) / len(block))
    return float(np.median(times)) + order / len(batches)


def trained(folder: Path, job: Job) -> None:
    """Print what training takes, in a process of its own."""
    store, targets = CodeStore.open(folder / "codes"), np.load(folder / "targets.npy", mmap_mode="c")
    batches = drawn(job, store, targets)
    step, memory, spent = ours(job, batches, new_network(job, store.table))(), resident(), drawing(batches)
    print(f"{' x '.join(map(str, job.hidden))}, batch {job.batch}: drawing {1e3 * spent:.2f} of {1e3 * step:.0f} ms "
          f"({100 * spent / step:.1f} %); memory of the process {memory['own']:.0f} MB, mapped files "
          f"{memory['mapped files']:.0f} MB", flush=True)


def whole_fit(folder: Path, frames: int) -> None:
    """Print what a fit of the default network takes as ``train.py`` does it, in a process of its own.

    A twentieth of the frames is drawn, in one epoch: memory does not depend on it.
    """
    table, rng = all_features(), np.random.default_rng(0)
    codes = [synthetic_store(table, UTTERANCE, seed=i) for i in range(frames // UTTERANCE)]
    shape = (UTTERANCE, STREAMS, DIMENSIONS)
    targets = files.mapped((rng.standard_normal(shape, dtype=np.float32) for _ in codes), folder)
    silent = Alignment([Tier("phones", [(0, UTTERANCE / 100, SILENCE)])])  # which a network does not look at
    examples = [Example(f"u{i}", silent, FrameCodes(c.table, c.arrays, c.rate),
                        targets[i * UTTERANCE : (i + 1) * UTTERANCE], np.ones(UTTERANCE, bool))
                for i, c in enumerate(codes)]
    before, peak, done, start = resident()["own"], [0.0], threading.Event(), time.perf_counter()

    def watch() -> None:
        while not done.wait(0.1):
            peak.append(resident()["own"])

    watcher = threading.Thread(target=watch)
    watcher.start()
    settings = FitSettings(epochs=1, batch_size=4096, share=0.05, progress=False, figure_every=0, accelerator="cpu")
    NetworkModel(table, FrameClock(100), NetworkModel.Settings(fit=settings)).fit(examples[10:], examples[:10], folder)
    done.set()
    watcher.join()
    print(f"a whole fit on {len(examples)} utterances: {max(peak):.0f} MB at its peak, {before:.0f} MB before it, "
          f"{time.perf_counter() - start:.0f} s")
    tell([Claim(f"MB of a fit on {frames / 360_000:g} hours, default network", max(peak), LIMIT)])


def main() -> None:
    """Print what was measured."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=14)
    arguments = parser.parse_args()
    warnings.filterwarnings("ignore")
    logging.getLogger("lightning.pytorch").setLevel(logging.WARNING)
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        child(partial(make, folder, round(arguments.hours * 360_000)))
        size = sum(p.stat().st_size for p in (folder / "codes").iterdir()) / 1e6
        store = opened(folder, report=True)
        dense = len(store) * store.table.width * 4 / 1e6
        print(f"{len(store):,} frames x {store.table.width} columns: {size:.0f} MB on disk, dense float32 {dense:,.0f} "
              f"MB, ratio {dense / size:.0f}")
        child(partial(opened, folder, report=False))  # type: ignore[arg-type]
        for job in (Job([512] * 3, 512, "adamw", 0.0), Job([3000] * 3, 100, "sgd", 0.5),
                    Job([3000] * 3, 1024, "sgd", 0.5)):
            child(partial(trained, folder, job))
        child(partial(whole_fit, folder, len(store)))


if __name__ == "__main__":
    main()
