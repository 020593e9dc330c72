"""Training at the paper's size on one GPU: seconds an epoch of 14 hours, and the share of the GPU's matrix products.

    python benchmarks/gpu.py                       5 x 3000 tanh, dropout .5, 5,040,000 frames, batch 100 and 4096

Codes and targets (2 GB) lie on the GPU, which draws its batches by itself; the fit is that of train.py. Some
seconds of each batch size are measured and an epoch follows from them. The last lines compare the ways to the first
layer, sum of rows against a one-hot matrix expanded on the GPU, forward and backward. The program takes some minutes,
most of them to make the corpus; ``--frames 200000 --hidden 256 256 --device cpu`` tries it without a GPU.
"""

import argparse
import logging
import time
import warnings
from collections.abc import Callable

import numpy as np
import torch
from synthetic import all_features, synthetic_store
from training import Job, ours, product_rate, random_targets

from dnnvss.labels import CodeStore
from dnnvss.models.code_sum import code_sum
from dnnvss.training.precision import has_bf16


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


def first_layer(store: CodeStore, batch: int, units: int, device: str, dtype: torch.dtype) -> tuple[float, float]:
    """Return milliseconds, forward and backward, of the first layer as a sum of rows and as a dense product."""
    rows = store.table.binary_width
    active = torch.as_tensor(store.active(np.random.default_rng(0).integers(0, len(store), batch))).to(device)
    weight = torch.randn(rows + 1, units, device=device, requires_grad=True)
    grad = torch.randn(batch, units, device=device)

    def summed() -> None:
        weight.grad = None
        code_sum(active, weight).backward(grad)

    def dense() -> None:
        weight.grad = None
        inputs = torch.zeros(batch, rows + 1, device=device, dtype=dtype).scatter_(1, active.long(), 1)
        (inputs @ weight.to(dtype)).float().backward(grad)

    return milliseconds(summed, device), milliseconds(dense, device)


def main() -> None:
    """Print a line a batch size, then the two ways to the first layer."""
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
    targets = random_targets(len(store))
    print(f"{name}: {' x '.join(map(str, arguments.hidden))}, {len(store):,} frames, {'bf16' if bf16 else 'float32'}")
    for batch in arguments.batches:
        job = Job(arguments.hidden, batch, "sgd", 0.5, arguments.device)
        step = ours(job, store, targets, "bf16-mixed" if bf16 else "32-true")()
        rate = 1 / product_rate(job, torch.bfloat16 if bf16 else torch.float32)()
        share = job.products * batch / 1e12 / rate / step
        print(f"batch {batch}: {1e3 * step:.2f} ms a step, {len(store) / batch * step:.1f} s an epoch; products "
              f"{rate:.1f} TFLOP/s, of which the step reaches {100 * share:.0f} %", flush=True)
    for batch in arguments.batches:
        dtype = torch.bfloat16 if bf16 else torch.float32
        summed, dense = first_layer(store, batch, arguments.hidden[0], arguments.device, dtype)
        print(f"first layer, batch {batch}: sum of rows {summed:.2f} ms, dense product {dense:.2f} ms", flush=True)


if __name__ == "__main__":
    main()
