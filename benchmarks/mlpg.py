"""Time of parameter generation: dnnvss, and nnmnkwii's compiled ``mlpg`` where it is installed, in one run on one core.

    OMP_NUM_THREADS=1 python benchmarks/mlpg.py

nnmnkwii imports only beside an old setuptools: ``pip install "setuptools>=77.0.3,<81" nnmnkwii``. Each time is the
least of repeated runs after a warm-up, which other work on the machine disturbs least. The two differ at the edges
only: nnmnkwii pads with zeros, dnnvss holds the end frames; the largest difference in the interior is printed.
"""

import time
import warnings
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import torch

from dnnvss.curves import STATIC_DELTA_DELTA2, mlpg

FRAMES, COLUMNS, BATCH = 300, 30, 64


def milliseconds(function: Callable[[], Any], repeats: int) -> float:
    """Return the least time of a call in milliseconds."""
    function()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times) * 1e3


def peer() -> Callable[[np.ndarray, np.ndarray], np.ndarray] | None:
    """Return nnmnkwii's mlpg for streams (T, W, D), or None where it cannot be imported."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            from nnmnkwii.paramgen import mlpg as other
    except ImportError as error:
        print(f"nnmnkwii is not installed ({error}): its column stays empty\n")
        return None
    windows = [(len(taps) // 2, len(taps) // 2, np.array(taps)) for taps in STATIC_DELTA_DELTA2.taps]

    def run(mean: np.ndarray, variance: np.ndarray) -> np.ndarray:
        flat = variance.reshape(*variance.shape[:-2], -1)
        return other(mean.reshape(len(mean), -1), flat, windows)

    return run


def nothing(mean: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """What stands for a program that is not there; nobody times it."""
    del variance
    return mean


def main() -> None:
    """Print the tables."""
    torch.set_num_threads(1)
    rng = np.random.default_rng(0)
    mean = rng.normal(size=(BATCH, FRAMES, len(STATIC_DELTA_DELTA2), COLUMNS))
    shared, framewise = rng.uniform(0.1, 1, size=mean.shape[2:]), rng.uniform(0.1, 1, size=mean.shape)
    known = peer()
    other = known or nothing

    def row(title: str, ours: Callable[[], Any], theirs: Callable[[], Any], repeats: int) -> None:
        a = milliseconds(ours, repeats)
        b = milliseconds(theirs, repeats) if known else float("nan")
        print(f"{title:<52}{a:>10.2f}{b:>12.2f}{b / a:>8.1f}")

    print(f"{FRAMES} frames x {COLUMNS} parameters, static + delta + delta-delta\n")
    print(f"{'milliseconds':<52}{'dnnvss':>10}{'nnmnkwii':>12}{'ratio':>8}")
    row("one sentence, one variance", lambda: mlpg(mean[0], shared), lambda: other(mean[0], shared), 100)
    first = mean[0], framewise[0]
    row("one sentence, a variance a frame", lambda: mlpg(*first), lambda: other(*first), 100)
    row(f"{BATCH} sentences, one variance", lambda: mlpg(mean, shared), lambda: [other(m, shared) for m in mean], 20)
    row(f"{BATCH} sentences, a variance a frame", lambda: mlpg(mean, framewise),
        lambda: [other(m, v) for m, v in zip(mean, framewise, strict=True)], 20)
    lengths = np.linspace(FRAMES // 2, FRAMES, BATCH).astype(int)
    row(f"{BATCH} ragged sentences, one variance", lambda: mlpg(mean, shared, lengths=lengths),
        lambda: [other(m[:t], shared) for m, t in zip(mean, lengths, strict=True)], 20)
    if known:
        apart = np.abs(mlpg(mean[0], shared) - other(mean[0], shared))[60:-60].max()
        print(f"\nlargest difference, 60 frames from the edges: {apart:.1e}")

    print(f"\n{'frames x 3 parameters':<52}{'ms':>10}{'us a frame':>12}")
    for frames in (1_000, 10_000, 100_000, 1_000_000):
        long = rng.normal(size=(frames, 3, 3))
        spent = milliseconds(partial(mlpg, long, shared[:, :3]), 3)
        print(f"{frames:<52}{spent:>10.1f}{spent / frames * 1e3:>12.2f}")


if __name__ == "__main__":
    main()
