"""How much longer a fit and a preparation take beside programs that keep the cores busy.

    python benchmarks/neighbours.py GRID WORK [--clips 60] [--busy 2] [--epochs 2]

GRID is the folder of recordings. Some of its clips are prepared and trained on (``labels=ph_d model=feedforward``),
alone and beside so many programs that do nothing but count; each command is a process of its own and begins anew. A
third column has the threads of OpenMP spin for work, as they do where nobody tells them to sleep. Printed are seconds
by the clock, the least of two. The system shares the cores out fairly: on two cores beside two programs a single
thread goes on undisturbed and two of them get half of each core, so that a command that keeps both cores busy takes
twice as long at least.
"""

import argparse
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from claim import Claim, tell
from hour import linked

from dnnvss.formats.tables import markdown_table

ROUNDS, TWICE = 2, 2.0
"""Of each command the best counts; so many times as long as alone it is to take at most."""
WAYS: Mapping[str, tuple[bool, Mapping[str, str]]] = {
    "alone": (False, {}), "beside them": (True, {}),
    "beside them, threads that spin": (True, {"GOMP_SPINCOUNT": "300000"})}
"""Each way: whether the cores are busy, and what the environment says. That many rounds are libgomp's own default."""


@contextmanager
def neighbours(count: int) -> Iterator[None]:
    """So many processes that count."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


def took(arguments: list[str], environment: Mapping[str, str]) -> float:
    """Seconds of a command."""
    begun = time.perf_counter()
    subprocess.run([sys.executable, *arguments], check=True, capture_output=True, env={**os.environ, **environment})
    return time.perf_counter() - begun


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("grid", type=Path)
    parser.add_argument("work", type=Path)
    parser.add_argument("--clips", type=int, default=60)
    parser.add_argument("--busy", type=int, default=2)
    parser.add_argument("--epochs", type=int, default=2)
    options = parser.parse_args()
    work: Path = options.work
    shutil.rmtree(work, ignore_errors=True)
    linked(options.grid, work / "raw", options.clips, plain=False)
    given = ["corpus=grid", "corpus.name=few", f"corpus.raw={work / 'raw'}", f"corpus.out={work / 'corpus'}"]
    commands = {"prepare": ["-m", "data_prep", *given],
                "train": ["train.py", *given, f"runs={work / 'runs'}", "labels=ph_d", "model=feedforward",
                          "sample=false", f"trainer.epochs={options.epochs}", "trainer.progress=false"]}
    made = {"prepare": work / "corpus", "train": work / "runs"}
    rows: dict[str, list[float]] = {name: [] for name in commands}
    for busy, environment in WAYS.values():
        best = dict.fromkeys(commands, float("inf"))
        for _ in range(ROUNDS):
            with neighbours(options.busy if busy else 0):
                for name, arguments in commands.items():
                    shutil.rmtree(made[name], ignore_errors=True)
                    best[name] = min(best[name], took(arguments, environment))
        for name, seconds in best.items():
            rows[name].append(seconds)
            print(f"{name}: {seconds:.0f} s", file=sys.stderr, flush=True)
    print(markdown_table(["seconds", *WAYS, "beside them over alone"],
                         [[name, *(f"{s:.0f}" for s in own), f"{own[1] / own[0]:.2f}"] for name, own in rows.items()]))
    tell(Claim(f"{name} beside {options.busy} busy programs, times alone", own[1] / own[0], TWICE)
         for name, own in rows.items())


if __name__ == "__main__":
    main()
