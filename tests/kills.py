"""Kills commands at every move of a file, before and after it, runs them again, and compares with a run left alone.

    python tests/kills.py FOLDER               every move of every command (make kills)
    python tests/kills.py FOLDER --few 3       three moves of each, spread over it
    python tests/kills.py FOLDER --only export --only speak

Each command runs in a fork of this process, which has loaded what they need, so that a trial takes about a second. A
trial ends well where the second run ends with status 0, leaves no temporary file, and every file is as it is without a
kill.
"""

import argparse
import hashlib
import json
import os
import shutil
import signal
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from dnnvss import staging

FAST = ("model=feedforward", "folds=0", "trainer.epochs=1",
        "trainer.progress=false", "trainer.figure_every=0", "trainer.accelerator=cpu",
        "model.network.hidden=[8]", "aam.modes=8", "jobs=1", "sample=false")
ROOT = Path(__file__).parents[1]
MOVES: list[Path] = []
"""What the command of this fork has moved."""
VOLATILE = ("tensorboard", "checkpoints")
"""Folders whose files hold the time at which they were written."""


@dataclass(frozen=True)
class Command:
    """A command that writes files in a home folder.

    Args:
        words: its arguments, from the home folder.
        needs: what lies in the home folder before it, from the folder of what was made beforehand.
    """

    words: Callable[[Path], tuple[object, ...]]
    needs: tuple[str, ...] = ()


COMMANDS = {
    "prepare": Command(lambda home: ("prepare", "corpus=demo", f"corpus.out={home}/data", "corpus.sentences=3",
                                     "corpus.size=64", "jobs=1")),
    "train": Command(lambda home: ("train", "corpus=demo", f"corpus.out={home}/data", f"runs={home}/runs",
                                   f"run={home}/runs/a", *FAST), ("data",)),
    "speak": Command(lambda home: ("speak", f"run={home}/runs/a", "text=hello", f"out={home}/o/hello.mp4",
                                   "speech=formant"), ("runs",)),
    "export": Command(lambda home: ("export", home / "runs/a", "--out", home / "bundle", "--network", "npz"),
                      ("runs",)),
    "compare": Command(lambda home: ("compare", home / "runs/a", "--out", home / "table"), ("data", "runs")),
    "label": Command(lambda home: ("label", "choose", home / "data/video", "--count", 3, "--out", home / "labels"),
                     ("data",)),
}


@dataclass(frozen=True)
class Trial:
    """A command that was killed at a move and run again: what is wrong then, nothing where all is well."""

    command: str
    move: int
    after: bool
    problem: str

    def __str__(self) -> str:
        when = "after" if self.after else "before"
        return f"{self.command} killed {when} move {self.move}: {self.problem or 'the same files'}"


def _nothing() -> None:
    """What comes before and after most commands."""


def run(words: tuple[object, ...], log: Path, kill: int = 0, after: bool = False,
        prepare: Callable[[], None] = _nothing, finish: Callable[[], None] = _nothing) -> int:
    """Run a command in a fork; return its status, negative where a signal ended it.

    Args:
        words: the command.
        log: what it prints goes there.
        kill: the move at which it is killed; 0 for none.
        after: whether it is killed when the file was moved, or before that.
        prepare, finish: called in the fork before and after the command.
    """
    sys.stdout.flush()
    child = os.fork()
    if not child:
        os._exit(_child([str(word) for word in words], log, kill, after, prepare, finish))
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def _child(words: list[str], log: Path, kill: int, after: bool, prepare: Callable[[], None],
           finish: Callable[[], None]) -> int:
    from dnnvss.commands.entry import main

    out = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.dup2(out, 1)
    os.dup2(out, 2)
    moved = staging.move

    def move(file: Path, path: Path) -> None:
        MOVES.append(path)
        if after:
            moved(file, path)
        if len(MOVES) == kill:
            os.kill(os.getpid(), signal.SIGKILL)
        if not after:
            moved(file, path)

    staging.move = move
    prepare()
    try:
        status = main(words)
    except SystemExit as ended:
        status = int(ended.code or 0)
    except BaseException:
        import traceback

        traceback.print_exc()
        status = 99
    sys.stdout.flush()
    sys.stderr.flush()
    finish()
    return status


def state(home: Path) -> dict[str, str]:
    """Digest of every file below a folder by its name; of a stage's result without the times of files in its key."""
    return {str(path.relative_to(home)): hashlib.sha256(_content(path)).hexdigest()
            for path in sorted(home.rglob("*"))
            if path.is_file() and not set(path.relative_to(home).parts) & set(VOLATILE)}


def _content(path: Path) -> bytes:
    if path.suffix == ".json" and ".stages" in path.parts:
        return json.dumps(json.loads(path.read_bytes())["result"]).encode()
    return path.read_bytes()


def made(folder: Path) -> Path:
    """A folder with a small corpus and a trained run, from which trials take what they need."""
    home = folder / "home"
    base = folder / "made"
    if not base.is_dir():
        fresh(home, None, ())
        words = [COMMANDS["prepare"].words(home), COMMANDS["train"].words(home)]
        words[0] = tuple("corpus.sentences=8" if "sentences" in str(w) else w for w in words[0])
        for each in words:
            assert run(each, folder / "log") == 0, (folder / "log").read_text()
        shutil.copytree(home, base)
    return base


def fresh(home: Path, base: Path | None, needs: tuple[str, ...], whole: bool = False) -> None:
    """Begin a home folder anew, with copies of what is needed; the face of a corpus only where ``whole``."""
    shutil.rmtree(home, ignore_errors=True)
    home.mkdir(parents=True)
    for name in needs:
        assert base is not None
        ignored = shutil.ignore_patterns("face") if name == "data" and not whole else None  # which training makes
        shutil.copytree(base / name, home / name, ignore=ignored)


def trials(folder: Path, name: str, few: int = 0) -> Iterator[Trial]:
    """Kill a command at its moves, all of them or a few; yield what came of each."""
    base, command, home, log = made(folder), COMMANDS[name], folder / "home", folder / "log"
    words = command.words(home)
    fresh(home, base, command.needs)
    log.write_text("")
    if run(words, log, finish=lambda: (folder / "count").write_text(str(len(MOVES))) and None):
        raise AssertionError(f"{name} alone: {log.read_text()}")
    whole, moves = state(home), int((folder / "count").read_text())
    for move in _spread(moves, few):
        for after in (False, True):
            fresh(home, base, command.needs)
            log.write_text("")
            killed = run(words, log, move, after)
            again = run(words, log)
            yield Trial(name, move, after, _problem(killed, again, whole, state(home), log))


def _spread(moves: int, few: int) -> list[int]:
    if not few or few >= moves:
        return list(range(1, moves + 1))
    return sorted({1 + round(k * (moves - 1) / max(few - 1, 1)) for k in range(few)})


def _problem(killed: int, again: int, whole: dict[str, str], now: dict[str, str], log: Path) -> str:
    if killed != -signal.SIGKILL:
        return f"it was not killed but ended with {killed}: {log.read_text()[-2000:]}"
    if again:
        return f"the second run ended with {again}: {log.read_text()[-2000:]}"
    left = [path for path in now if path not in whole]
    lacking = [path for path in whole if path not in now]
    other = [path for path in whole if path in now and now[path] != whole[path]]
    return "; ".join(f"{what}: {', '.join(paths[:5])}" for what, paths in
                     (("left", left), ("lacking", lacking), ("other", other)) if paths)


def load() -> None:
    """Load what the commands need, once for all forks."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    import av  # noqa: F401
    import lightning  # noqa: F401
    import torch

    import data_prep.demo  # noqa: F401
    import dnnvss.commands.train
    import dnnvss.evaluation.finished
    import dnnvss.render.plots
    import dnnvss.runs.bundling  # noqa: F401

    torch.set_num_threads(1)


def main() -> int:
    """Run the trials that the command line asks for; status 1 where one ended badly."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--few", type=int, default=0)
    parser.add_argument("--only", action="append", choices=COMMANDS)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    folder = options.folder.resolve()
    load()
    count = bad = 0
    for name in options.only or COMMANDS:
        for trial in trials(folder, name, options.few):
            count, bad = count + 1, bad + bool(trial.problem)
            if trial.problem:
                print(trial, flush=True)
        print(f"{name}: {count} kills so far, {bad} ended badly", flush=True)
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
