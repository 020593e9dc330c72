"""Runs commands with too little memory or too few open files, and again without the limit.

    python tests/limits.py FOLDER                every command under every limit (make limits)
    python tests/limits.py FOLDER --few          two limits of each kind
    python tests/limits.py FOLDER --only track --only speak

Memory is limited (``RLIMIT_DATA``: what a process may allocate) in forks of this process, which has loaded torch and
all else that commands need: libraries alone take most of the smallest limit. Files are limited in new processes, as
``ulimit -n`` does it, with as many threads. A trial ends well where the limited command makes all its files, or says in
one line what is too little (a sweep in one for each of its runs); and where the same command without the limit then
makes the files that it makes in a new folder.
"""

import argparse
import os
import resource
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import kills

COMMANDS = tuple(name for name in kills.COMMANDS if kills.COMMANDS[name].before is kills.left_alone)
"""Those that need nothing done in their process: others are asked by a browser, or have a tracker."""
MEMORY = (600, 800, 1000, 1500)
"""Megabytes."""
HANDLES = (16, 32, 64, 128)
"""Open files."""
SHORT = ("the system is short of", "there was too little memory")
"""What a command says that ends because of a limit."""
SWEPT = "of the sweep failed"
"""What a sweep says behind what each of its runs said."""


@dataclass(frozen=True)
class Trial:
    """A command under a limit, and again without.

    Args:
        command, limit: which.
        ended: ``well`` or ``told``.
        problem: what is wrong; nothing where all is well.
    """

    command: str
    limit: str
    ended: str
    problem: str

    def __str__(self) -> str:
        return f"{self.command} with {self.limit}: {self.ended}{f', but {self.problem}' if self.problem else ''}"


def _limit(kind: int, amount: int) -> None:
    resource.setrlimit(kind, (amount, amount))


def under_memory(words: tuple[object, ...], log: Path, megabytes: int) -> int:
    """The status of a command in a fork that may allocate so much."""
    return kills.run(words, log, prepare=lambda: _limit(resource.RLIMIT_DATA, megabytes * 2**20))


def under_handles(words: tuple[object, ...], log: Path, count: int) -> int:
    """The status of a command in a new process that may open so many files."""
    environment = {**os.environ, "PYTHONPATH": str(kills.ROOT)}
    limited = ["bash", "-c", f'ulimit -n {count}; exec "$@"', "limited", sys.executable, "-m", "dnnvss"]
    with log.open("a") as out:
        return subprocess.run([*limited, *map(str, words)], stdout=out, stderr=out, env=environment, cwd=kills.ROOT,
                              check=False).returncode


def trials(folder: Path, name: str, memory: tuple[int, ...], handles: tuple[int, ...]) -> Iterator[Trial]:
    """A command under each limit; yield what came of it."""
    base, command, home, log = kills.made(folder), kills.COMMANDS[name], folder / "home", folder / "log"
    words = command.words(home)
    kills.fresh(home, base, command.needs, command.whole)
    log.write_text("")
    if kills.run(words, log):
        raise AssertionError(f"{name} alone: {log.read_text()}")
    whole = kills.state(home)
    each = [(f"{count} open files", under_handles, count) for count in handles]
    each += [(f"{megabytes} MB", under_memory, megabytes) for megabytes in memory]
    for limit, under, amount in each:
        kills.fresh(home, base, command.needs, command.whole)
        log.write_text("")
        status = under(words, log, amount)
        said = log.read_text(errors="replace")
        problem = _told(status, said) if status else _different(whole, kills.state(home))
        log.write_text("")
        if again := kills.run(words, log):
            problem += f" the same command without the limit ended with {again}: {log.read_text()[-1500:]}"
        elif not problem:
            problem = _different(whole, kills.state(home))
        yield Trial(name, limit, "told" if status else "well", problem)


def _told(status: int, said: str) -> str:
    """What is wrong with how a command ended that had too little."""
    lines = [line for line in said.replace("\r", "\n").splitlines() if line.startswith("error: ")]
    swept = bool(lines) and SWEPT in lines[-1]
    told = lines[:-1] if swept else lines
    short = all(any(words in line for words in SHORT) for line in told)
    if status == 1 and "Traceback" not in said and short and (len(told) == 1 or (told and swept)):
        return ""
    return f"it ended with {status}: {said[-2500:]}"


def _different(whole: dict[str, str], now: dict[str, str]) -> str:
    names = sorted(name for name in {*whole, *now} if whole.get(name) != now.get(name))
    return f"other files than without a limit: {', '.join(names[:5])}" if names else ""


def main() -> int:
    """Run the trials that the command line asks for; status 1 where one ended badly."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--few", action="store_true", help="16 files and 600 MB alone")
    parser.add_argument("--only", action="append", choices=COMMANDS)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    folder = options.folder.resolve()
    kills.load()
    count = told = bad = 0
    memory, handles = (MEMORY[:1], HANDLES[:1]) if options.few else (MEMORY, HANDLES)
    for name in options.only or COMMANDS:
        for trial in trials(folder, name, memory, handles):
            count, told, bad = count + 1, told + (trial.ended == "told"), bad + bool(trial.problem)
            if trial.problem:
                print(trial, flush=True)
        print(f"{name}: {count} trials so far, {told} said what was too little, {bad} ended badly", flush=True)
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
