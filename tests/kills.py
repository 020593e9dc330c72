"""Kills commands at moves of files and at any time, runs them again, and compares with a run left alone.

    python tests/kills.py FOLDER               every move of every command, before and after it, and times (make kills)
    python tests/kills.py FOLDER --few 3       three moves of each, spread over it, and no times
    python tests/kills.py FOLDER --few 1 --times 9
    python tests/kills.py FOLDER --only export --only speak

Each command runs in a fork of this process, which has loaded what they need, so that a trial takes seconds. The
system's folder for temporary files is one of the trial's. A trial ends well where the killed command leaves no process,
the second run ends with status 0 and leaves no temporary file, and every file is as it is without a kill.
"""

import argparse
import contextlib
import hashlib
import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dnnvss import staging

QUICK = ("folds=0", "trainer.epochs=1", "trainer.progress=false", "trainer.figure_every=0", "trainer.accelerator=cpu",
         "aam.modes=8", "jobs=1")
FAST = (*QUICK, "model=feedforward", "model.network.hidden=[8]", "sample=false")
ROOT = Path(__file__).parents[1]
MOVES: list[Path] = []
"""What the command of this fork has moved."""
VOLATILE = ("tensorboard", "checkpoints")
"""Folders whose files hold the time at which they were written, and may be more after a second run."""
TOKEN = "DNNVSS_KILLS"
"""A variable of the environment by which the processes that a command started are found."""
TEMPORARY = "tmp"
"""The folder, in that of a trial, that commands have for temporary files."""
LONGEST = 20.0
"""Seconds after which a process whose parent was killed should have ended, where the processors are free."""


def left_alone(home: Path) -> None:
    """What is done in the process of most commands beforehand."""


@dataclass(frozen=True)
class Command:
    """A command that writes files in a home folder.

    Args:
        words: its arguments, from the home folder.
        needs: what lies in the home folder before it, from the folder of what was made beforehand.
        whole: whether the face of the corpus is needed, which training makes.
        before: called in its process, with the home folder, before the command.
    """

    words: Callable[[Path], tuple[object, ...]]
    needs: tuple[str, ...] = ()
    whole: bool = False
    before: Callable[[Path], None] = left_alone


def _drag(home: Path) -> None:
    """Let the page of labels be used as by a browser: every point is dragged a little and kept; then it is left."""
    from dnnvss.studio.server import Server

    Server.wait = lambda self: _drag_all(self.url, home / "labels")  # type: ignore[method-assign]


def _drag_all(url: str, folder: Path) -> None:
    """Drag every point of the labels in a folder, on their page."""
    from urllib.parse import quote

    import numpy as np

    from dnnvss.face.aam.labelling.sheet import Sheet

    sheet = Sheet.open(folder)
    for k, label in enumerate(sheet.labels):
        points = np.round(sheet.read(label)).tolist()
        _ask(f"{url}points/{quote(label.image, safe='')}", {"points": points, "done": bool(k % 2)})


def _ask(url: str, body: object = None) -> bytes:
    """What a page answers: to a body as JSON, or to a mere look."""
    from urllib.request import Request, urlopen

    data = None if body is None else json.dumps(body).encode()
    with urlopen(Request(url, data, {"Content-Type": "application/json"} if data else {}), timeout=60) as answer:
        return bytes(answer.read())


def _talk(home: Path) -> None:
    """Let the studio be used: a take is said, and a file of it taken away; then labels are dragged in their area."""
    from urllib.error import HTTPError

    from dnnvss.studio.server import Server

    def wait(self: Server) -> None:
        for _ in range(600):  # until a worker is there
            with contextlib.suppress(HTTPError):
                _ask(f"{self.url}v1/health")
                break
            time.sleep(0.1)
        take = json.loads(_ask(f"{self.url}v1/speak", {"run": "a", "text": "hello", "engine": "formant"}))
        (home / "speech.mp4").write_bytes(_ask(f"{self.url}v1/takes/{take['id']}/files/speech.mp4"))
        _drag_all(f"{self.url}labelling/labels/", home / "labels")

    Server.wait = wait  # type: ignore[method-assign]


def _watch(home: Path) -> None:
    """Let lips be seen where no tracker is installed, and where a drawn face is none for it: the light of each row."""
    import numpy as np

    import dnnvss.evaluation.outside
    import dnnvss.face.landmarker
    from dnnvss.evaluation.outside import Lips

    def see(landmarker: object, pictures: Iterable[np.ndarray]) -> Lips:
        thirds = np.array([[part.mean() for part in np.array_split(picture, 3)] for picture in pictures])
        return Lips(thirds, np.ones(len(thirds), bool))

    sys.modules["dnnvss.evaluation.outside.judge"].see = see  # type: ignore[attr-defined]
    dnnvss.face.landmarker.find_task = lambda path: home  # type: ignore[assignment]
    dnnvss.face.landmarker.Landmarker = lambda path: None  # type: ignore[assignment,misc]


COMMANDS = {
    "prepare": Command(lambda home: ("prepare", "corpus=demo", f"corpus.out={home}/data", "corpus.sentences=3",
                                     "corpus.size=64", "jobs=1")),
    "recordings": Command(lambda home: ("prepare", "corpus=folder", f"corpus.raw={home}/raw", f"corpus.out={home}/own",
                                        "jobs=2"), ("raw",)),
    "train": Command(lambda home: ("train", "corpus=demo", f"corpus.out={home}/data", f"runs={home}/runs",
                                   f"run={home}/runs/a", *FAST), ("data",)),
    "samples": Command(lambda home: ("train", "corpus=demo", f"corpus.out={home}/data", f"runs={home}/runs",
                                     "model=phone_mean", "labels=ph_d", *QUICK),
                       ("data",), whole=True),
    "sweep": Command(lambda home: ("train", "-m", "corpus=demo", f"corpus.out={home}/data", f"runs={home}/runs",
                                   f"hydra.sweep.dir={home}", "labels=ph_d", "model=phone_mean,training_mean",
                                   *QUICK, "sample=false"), ("data",), whole=True),
    "speak": Command(lambda home: ("speak", f"run={home}/runs/a", "text=hello", f"out={home}/o/hello.mp4",
                                   f"export_curves={home}/o/c.csv", f"export_keys={home}/o/k.csv",
                                   f"export_alignment={home}/o/t.TextGrid", "speech=formant"), ("runs",)),
    "export": Command(lambda home: ("export", home / "runs/a", "--out", home / "bundle", "--network", "npz"),
                      ("runs",)),
    "compare": Command(lambda home: ("compare", home / "runs/a", "--out", home / "table"), ("data", "runs")),
    "label": Command(lambda home: ("label", "choose", home / "data/video", "--count", 3, "--out", home / "labels"),
                     ("data",)),
    "import": Command(lambda home: ("label", "import", home / "labels", "--from", home / "coco.json"),
                      ("labels", "coco.json")),
    "page": Command(lambda home: ("label", "page", home / "labels", "--port", 0), ("labels",), before=_drag),
    "track": Command(lambda home: ("track", home / "labels", home / "raw", "--out", home / "tracked", "--jobs", 2,
                                   "--own", 6), ("labels", "raw")),
    "figure": Command(lambda home: ("figure", home / "runs/a", "--coefficient", 1, "--out", home / "f.png"),
                      ("data", "runs")),
    "face-figures": Command(lambda home: ("face-figures", home / "runs/a", "--modes", 2, "--out", home / "face"),
                            ("data", "runs")),
    "units": Command(lambda home: ("units", home / "runs/v", "--out", home / "units"), ("runs",)),
    "animators": Command(lambda home: ("speak", f"run={home}/runs/a", "text=hello", f"out={home}/o/a.mp4",
                                       f"export_rig={home}/o/take.json", f"export_visemes={home}/o/v.json",
                                       "rig_curves=plain", "speech=formant"), ("runs",)),
    "rig": Command(lambda home: ("rig", home / "takes/t0.csv", "--out", home / "o/t.mp4", home / "o/t.glb",
                                 home / "o/t.csv", home / "o/t.json", "--height", 32, "--rate", 10), ("takes",)),
    "motion": Command(lambda home: ("prepare", "corpus=motion", f"corpus.raw={home}/takes", f"corpus.out={home}/moved",
                                    "jobs=2"), ("takes",)),
    "session": Command(lambda home: ("prepare", "corpus=session", f"corpus.raw={home}/raw", f"corpus.out={home}/own",
                                     "corpus.importer.form=curves", "corpus.importer.sentences=3",
                                     "corpus.importer.held_out=1", "jobs=2")),
    "viewing": Command(lambda home: ("viewing", "make", home / "design.yaml", home / "runs/a", home / "runs/v", "--out",
                                     home / "test", "--jobs", 2), ("data", "runs", "design.yaml")),
    "analyse": Command(lambda home: ("viewing", "analyse", home / "test"), ("data", "runs", "test")),
    "correlations": Command(lambda home: ("correlations", f"folder={home}/runs/a", "study=context", "study.repeats=2",
                                          "study.first=10", "study.last=20", "study.step=10", f"out={home}/heard"),
                            ("data", "runs"), whole=True),
    "outside": Command(lambda home: ("outside", home / "runs/a"), ("data", "runs"), before=_watch),
    "studio": Command(lambda home: ("studio", home / "runs", "--port", 0, "--folder", home, "--workers", 1),
                      ("runs", "labels"), before=_talk),
}
ALONE = ("train", "corpus=demo", "labels=ph_dv", "visemes.units=6", *FAST)
"""What makes the run ``v``, whose labels have dynamic visemes."""


@dataclass(frozen=True)
class Trial:
    """A command that was killed and run again: what is wrong then, nothing where all is well."""

    command: str
    when: str
    problem: str

    def __str__(self) -> str:
        return f"{self.command} killed {self.when}: {self.problem or 'the same files'}"


def _nothing() -> None:
    """What comes before and after most commands."""


def run(words: tuple[object, ...], log: Path, kill: int = 0, after: bool = False,
        prepare: Callable[[], None] = _nothing, finish: Callable[[], None] = _nothing,
        seconds: float | None = None) -> int:
    """Run a command in a fork; return its status, negative where a signal ended it.

    Args:
        words: the command.
        log: what it prints goes there.
        kill: the move at which it is killed; 0 for none.
        after: whether it is killed when the file was moved, or before that.
        prepare, finish: called in the fork before and after the command.
        seconds: after which it is killed, if it has not ended.
    """
    sys.stdout.flush()
    child = os.fork()
    if not child:
        os._exit(_child([str(word) for word in words], log, kill, after, prepare, finish))
    if seconds is not None:
        time.sleep(seconds)
        os.kill(child, signal.SIGKILL)
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
    """Digest of every file below a folder by its name; of a stage's result without the times of files in its key.

    Of the files that hold times only temporary ones are there, and folders that should not stay.
    """
    found = {}
    for path in sorted(home.rglob("*")):
        name = path.relative_to(home)
        volatile = bool(set(name.parts) & set(VOLATILE))
        if path.is_file() and (not volatile or staging.is_ours(path.name)):
            found[str(name)] = hashlib.sha256(_content(path)).hexdigest()
        elif path.is_dir() and (path.parent.name == TEMPORARY or path.name.startswith(".")) and path.name != ".stages":
            found[str(name)] = "folder"
    return found


def _content(path: Path) -> bytes:
    if path.suffix == ".json" and ".stages" in path.parts:
        return json.dumps(json.loads(path.read_bytes())["result"]).encode()
    return path.read_bytes()


def made(folder: Path) -> Path:
    """A folder with a small corpus and a trained run, from which trials take what they need."""
    from kills_made import write_all

    home = folder / "home"
    base = folder / "made"
    if not base.is_dir():
        fresh(home, None, ())
        words = [COMMANDS["prepare"].words(home), COMMANDS["train"].words(home),
                 (*ALONE, f"corpus.out={home}/data", f"runs={home}/runs", f"run={home}/runs/v")]
        words[0] = tuple("corpus.sentences=8" if "sentences" in str(w) else w for w in words[0])
        for each in words:
            assert run(each, folder / "log") == 0, (folder / "log").read_text()
        _in_fork(lambda: write_all(home))
        shutil.copytree(home, base)
    return base


def _in_fork(work: Callable[[], Any]) -> None:
    """Do what opens videos in a fork: threads of a decoder that is not closed yet would hang the forks of trials."""
    if child := os.fork():
        assert not os.waitpid(child, 0)[1]
        return
    status = 1
    try:
        work()
        status = 0
    finally:
        os._exit(status)


def fresh(home: Path, base: Path | None, needs: tuple[str, ...], whole: bool = False) -> None:
    """Begin a home folder anew, with copies of what is needed; the face of a corpus only where ``whole``."""
    shutil.rmtree(home, ignore_errors=True)
    home.mkdir(parents=True)
    for name in needs:
        assert base is not None
        if (base / name).is_file():
            shutil.copyfile(base / name, home / name)
            continue
        ignored = shutil.ignore_patterns("face") if name == "data" and not whole else None  # which training makes
        shutil.copytree(base / name, home / name, ignore=ignored)


def trials(folder: Path, name: str, few: int = 0, times: int = 0) -> Iterator[Trial]:
    """Kill a command at its moves, all of them or a few, and at some times; yield what came of each."""
    base, command, home, log = made(folder), COMMANDS[name], folder / "home", folder / "log"
    words = command.words(home)
    fresh(home, base, command.needs, command.whole)
    log.write_text("")
    start = time.monotonic()
    before = {"prepare": lambda: _prepare(command, home)}
    if run(words, log, **before, finish=lambda: (folder / "count").write_text(str(len(MOVES))) and None):
        raise AssertionError(f"{name} alone: {log.read_text()}")
    lasts = time.monotonic() - start
    whole, moves, rng = state(home), int((folder / "count").read_text()), random.Random(name)
    kills: list[tuple[str, dict[str, Any]]] = [
        (f"{'after' if after else 'before'} move {move}", {"kill": move, "after": after})
        for move in _spread(moves, few) for after in (False, True)]
    seconds = sorted(rng.uniform(0.02, 0.9) * lasts for _ in range(times))
    kills += [(f"after {each:.2f} s of {lasts:.2f}", {"seconds": each}) for each in seconds]
    for when, how in kills:
        fresh(home, base, command.needs, command.whole)
        log.write_text("")
        killed = run(words, log, **before, **how)
        if killed == 0 and "seconds" in how:
            continue  # it was faster than before
        left = orphans()
        _age(home / TEMPORARY)
        again = run(words, log, **before)
        problem = f"{left} processes stayed; " if left else ""
        yield Trial(name, when, problem + _problem(killed, again, whole, state(home), log))


def _prepare(command: Command, home: Path) -> None:
    """Begin a command with a folder of its own for temporary files."""
    (home / TEMPORARY).mkdir(exist_ok=True)
    os.environ["TMPDIR"] = tempfile.tempdir = str(home / TEMPORARY)
    command.before(home)


def _age(folder: Path) -> None:
    """Let what a killed command left be a minute old: what is new may be another command's that is just beginning."""
    past = time.time() - 60
    for path in folder.iterdir() if folder.is_dir() else ():
        os.utime(path, (past, past), follow_symlinks=False)


def orphans() -> int:
    """How many of the processes that killed commands started are still there after :data:`LONGEST`."""
    busy = max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))
    until = time.monotonic() + LONGEST * busy
    while (left := _started()) and time.monotonic() < until:
        time.sleep(0.1)
    return len(left)


def _started() -> list[int]:
    """The processes that were started with the variable, and are none of the forks of this one."""
    mark = f"{TOKEN}={os.environ[TOKEN]}".encode()
    found = []
    for path in Path("/proc").glob("[0-9]*"):
        try:
            if mark in (path / "environ").read_bytes().split(b"\0") and int(path.name) != os.getpid():
                found.append(int(path.name))
        except OSError:
            continue
    return found


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
    """Load what the commands need, once for all forks.

    One thread each, as the last digits depend on their number: it is set before numpy is loaded, so that forks and new
    processes have the same.
    """
    os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"
    os.environ[TOKEN] = str(os.getpid())  # what is forked has it not, what is started has
    import av  # noqa: F401
    import lightning  # noqa: F401
    import torch

    import data_prep.demo
    import data_prep.folder  # noqa: F401
    import dnnvss.commands.train
    import dnnvss.evaluation.finished
    import dnnvss.face.aam.tracking
    import dnnvss.render.plots
    import dnnvss.runs.bundling  # noqa: F401

    torch.set_num_threads(1)


def main() -> int:
    """Run the trials that the command line asks for; status 1 where one ended badly."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--few", type=int, default=0, help="moves of each command; 0 for all")
    parser.add_argument("--times", type=int, help="kills of each command at any time; 9 unless --few is given")
    parser.add_argument("--only", action="append", choices=COMMANDS)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    folder = options.folder.resolve()
    load()
    count = bad = 0
    times = options.times if options.times is not None else 0 if options.few else 9
    for name in options.only or COMMANDS:
        for trial in trials(folder, name, options.few, times):
            count, bad = count + 1, bad + bool(trial.problem)
            if trial.problem:
                print(trial, flush=True)
        print(f"{name}: {count} kills so far, {bad} ended badly", flush=True)
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
