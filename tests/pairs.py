"""Pairs of different commands that write or read one place at once.

    python tests/pairs.py FOLDER               ten pairs, three times each
    python tests/pairs.py FOLDER --times 1 --only 2

A pair ends well where each command makes its files or says in one line why not; where those that refused then end with
status 0, or say again what stands in the way; and where the files are then those of one command after the other, in
either order.
"""

import argparse
import os
import random
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import kills

Words = tuple[object, ...]


@dataclass(frozen=True)
class Pair:
    """Two commands.

    Args:
        title: what they do.
        words: of the first and of the second, from the home folder.
        needs: what lies in the home folder before them.
    """

    title: str
    words: Callable[[Path], tuple[Words, Words]]
    needs: tuple[str, ...] = ("data", "runs", "raw", "labels", "coco.json")


def _prepare(home: Path, *more: str) -> Words:
    return ("prepare", "corpus=demo", f"corpus.out={home}/data", "corpus.size=64", "jobs=1", *more)


def _train(home: Path, *more: str) -> Words:
    return ("train", "corpus=demo", f"corpus.out={home}/data", f"runs={home}/runs", *kills.FAST, *more)


def _speak(home: Path, run: str, out: str, text: str = "hello") -> Words:
    return ("speak", f"run={home}/{run}", f"text={text}", f"out={home}/{out}", "speech=formant")


PAIRS = (
    Pair("a corpus is prepared anew while a system is trained on it",
         lambda h: (_prepare(h, "corpus.sentences=9"), _train(h, f"run={h}/runs/b"))),
    Pair("two corpora into one folder",
         lambda h: (_prepare(h, "corpus.sentences=8"), _prepare(h, "corpus.sentences=8", "corpus.seed=1"))),
    Pair("a run is trained anew while it speaks into its own folder",
         lambda h: (_train(h, f"run={h}/runs/a", "overwrite=true"), _speak(h, "runs/a", "runs/a/said.mp4"))),
    Pair("a run is exported over a bundle that speaks",
         lambda h: (("export", h / "runs/a", "--out", h / "runs/bundle", "--network", "npz"),
                    _speak(h, "runs/a", "runs/bundle/said.mp4"))),
    Pair("two trainings of one run",
         lambda h: (_train(h, f"run={h}/runs/b"), _train(h, f"run={h}/runs/b"))),
    Pair("two different trainings into one run",
         lambda h: (_train(h, f"run={h}/runs/b"), _train(h, f"run={h}/runs/b", "labels=ph_a"))),
    Pair("labels are chosen where they are tracked from",
         lambda h: (("track", h / "labels", h / "raw", "--out", h / "tracked", "--jobs", 1),
                    ("label", "import", h / "labels", "--from", h / "coco.json"))),
    Pair("a run is compared while it is trained anew",
         lambda h: (("compare", h / "runs/a", "--out", h / "table"), _train(h, f"run={h}/runs/a", "overwrite=true"))),
    Pair("a face's figures and the units' into one folder",
         lambda h: (("face-figures", h / "runs/v", "--modes", 2, "--out", h / "figures"),
                    ("units", h / "runs/v", "--out", h / "figures"))),
    Pair("videos are tracked to where they are prepared from",
         lambda h: (("track", h / "labels", h / "raw", "--out", h / "tracked", "--jobs", 1),
                    ("prepare", "corpus=folder", f"corpus.raw={h}/tracked", f"corpus.out={h}/own", "jobs=1"))),
)


def _begin(words: Words, log: Path) -> int:
    sys.stdout.flush()
    if not (child := os.fork()):
        os._exit(kills._child([str(word) for word in words], log, 0, False, kills._nothing, kills._nothing))
    return child


def _end(child: int) -> int:
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def play(folder: Path, pair: Pair, number: int) -> str:
    """What is wrong with how a pair ended; nothing where all is well."""
    base, home, logs = kills.made(folder), folder / "home", (folder / "first.log", folder / "second.log")
    orders = []
    for order in ((0, 1), (1, 0)):
        kills.fresh(home, base, pair.needs, whole=True)
        for which in order:
            _end(_begin(pair.words(home)[which], folder / "log"))
        for which in order:  # what was refused may go now
            _end(_begin(pair.words(home)[which], folder / "log"))
        orders.append(kills.state(home))
    kills.fresh(home, base, pair.needs, whole=True)
    for log in logs:
        log.write_text("")
    rng = random.Random(f"{pair.title} {number}")
    children = [_begin(pair.words(home)[0], logs[0])]
    time.sleep(rng.choice((0.0, 0.2, 0.6, 1.2)))
    children.append(_begin(pair.words(home)[1], logs[1]))
    statuses = [_end(child) for child in children]
    problems = [_told(status, log) for status, log in zip(statuses, logs, strict=True) if status]
    for which in rng.sample((0, 1), 2):
        _end(_begin(pair.words(home)[which], folder / "log"))
    now = kills.state(home)
    if now not in orders:
        near = min(orders, key=lambda order: len(_different(order, now)))
        problems.append(f"the files are those of neither order: {', '.join(_different(near, now)[:6])}")
    return "; ".join(filter(None, problems))


def _different(one: dict[str, str], other: dict[str, str]) -> list[str]:
    return sorted(name for name in {*one, *other} if one.get(name) != other.get(name))


def _told(status: int, log: Path) -> str:
    said = log.read_text(errors="replace")
    lines = [line for line in said.replace("\r", "\n").splitlines() if line.startswith("error: ")]
    return "" if status == 1 and len(lines) == 1 and "Traceback" not in said else f"ended with {status}: {said[-1500:]}"


def main() -> int:
    """Play the pairs; status 1 where one ended badly."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--times", type=int, default=3)
    parser.add_argument("--only", type=int, action="append", help="numbers of pairs, from 0")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    folder = options.folder.resolve()
    kills.load()
    bad = 0
    for number, pair in enumerate(PAIRS):
        if options.only and number not in options.only:
            continue
        found = [problem for k in range(options.times) if (problem := play(folder, pair, k))]
        bad += len(found)
        print(f"{number} {pair.title}: {options.times - len(found)} of {options.times} ended well", flush=True)
        for problem in found:
            print(f"    {problem}", flush=True)
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
