"""All claims of speed and memory in one table, each from a program of this folder.

    python benchmarks/claims.py RUN GRID WORK                    all of them, one after the other, on an idle machine
    python benchmarks/claims.py RUN GRID WORK --only start text  those whose names are given
    python benchmarks/claims.py --list                           names, minutes and commands

RUN is a finished run of GRID (``labels=ph_d model=feedforward``), GRID the folder of its recordings, WORK a folder for
what is made on the way, which stays. Each program prints its own table and tells its claims; those stand together at
the end, in WORK/claims.md too. A program that fails ends none of the others and is told at the end.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from claim import FILE, Claim

from dnnvss.formats.tables import markdown_table

ROOT = Path(__file__).parents[1]


@dataclass(frozen=True)
class Program:
    """A program that claims something. In commands, RUN, GRID and WORK stand for the places that are given.

    Args:
        command: what is run, by Python.
        minutes: it takes about so many.
        threads: of arithmetic, 0 for as many as the machine has.
        makes: what it needs in WORK, and the command that makes it where it is not there.
    """

    command: str
    minutes: float
    threads: int = 1
    makes: tuple[str, str] = ("", "")


PROGRAMS = {
    "training": Program("benchmarks/training.py --rounds 2", 3, threads=0),
    "loss": Program("benchmarks/same_loss.py WORK/demo", 3,
                    makes=("WORK/demo", "-m data_prep corpus=demo corpus.out=WORK/demo")),
    "memory": Program("benchmarks/memory.py", 3),
    "start": Program("benchmarks/startup.py RUN WORK/bundle", 2,
                     makes=("WORK/bundle", "-m dnnvss export RUN --out WORK/bundle")),
    "trajectory": Program("benchmarks/latency.py RUN", 1),
    "text": Program("benchmarks/long_text.py --words 5000 20000 --voice 20000", 4),
    "speech": Program("benchmarks/long_speech.py RUN --words 1000 20000 --video 1000", 7),
    "neighbours": Program("benchmarks/neighbours.py GRID WORK/neighbours --epochs 1", 8, threads=0),
    "hour": Program("benchmarks/hour.py GRID WORK/hour", 12, threads=0),
    "hour_plain": Program("benchmarks/hour.py GRID WORK/hour --plain", 30, threads=0),
    "growth": Program("benchmarks/growth.py WORK/growth", 30),
}
"""By name, in the order in which they run."""


def ran(program: Program, places: dict[str, Path], gathered: Path) -> bool:
    """Run a program, and before it what makes what it needs; whether both ended well."""
    needed, command = program.makes
    commands = [*([command] if needed and not Path(_placed(needed, places)[0]).exists() else []), program.command]
    environment = {**os.environ, FILE: str(gathered), "PYTHONPATH": str(ROOT)}
    if program.threads:
        environment["OMP_NUM_THREADS"] = str(program.threads)
    for words in (_placed(command, places) for command in commands):
        print(f"\n$ python {' '.join(words)}", flush=True)
        if subprocess.run([sys.executable, *words], cwd=ROOT, env=environment).returncode:
            return False
    return True


def _placed(command: str, places: dict[str, Path]) -> list[str]:
    """Words of a command with what is given in its places."""
    for name, path in places.items():
        command = command.replace(name, str(path.resolve()))
    return command.split()


def table(gathered: Path) -> str:
    """What was told, as Markdown."""
    told = [Claim(**json.loads(line)) for line in gathered.read_text("utf-8").splitlines()]
    return markdown_table(("claim", "found", "limit", "kept"), [claim.row for claim in told])


def main() -> None:
    """Run programs and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, nargs="?", metavar="RUN")
    parser.add_argument("grid", type=Path, nargs="?", metavar="GRID")
    parser.add_argument("work", type=Path, nargs="?", metavar="WORK")
    parser.add_argument("--only", nargs="+", choices=list(PROGRAMS), default=list(PROGRAMS))
    parser.add_argument("--list", action="store_true", help="print names, minutes and commands, and stop")
    options = parser.parse_args()
    if options.list:
        print("\n".join(f"{name:12} {p.minutes:3g} min  python {p.command}" for name, p in PROGRAMS.items()))
        return
    if options.work is None:
        parser.error("RUN, GRID and WORK are needed")
    places = {"RUN": options.run, "GRID": options.grid, "WORK": options.work}
    options.work.mkdir(parents=True, exist_ok=True)
    gathered, page = options.work / "claims.jsonl", options.work / "claims.md"
    gathered.write_text("", "utf-8")
    begun, failed = time.perf_counter(), list[str]()
    for name in options.only:
        if not ran(PROGRAMS[name], places, gathered):
            failed.append(name)
        page.write_text(table(gathered), "utf-8")
    print(f"\n{page.read_text('utf-8')}\n{(time.perf_counter() - begun) / 60:.0f} minutes")
    if failed:
        raise SystemExit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
