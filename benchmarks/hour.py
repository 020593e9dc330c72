"""An hour of video to a speaking face: where the minutes go, stage by stage.

    python benchmarks/hour.py GRID WORK [--minutes 60] [--plain] [--jobs 2]

Clips of GRID (the folder of its recordings: ``video``, ``align``, ``landmarks``) are linked into WORK, again and
again under new ids until they last so long; ``--plain`` leaves their landmarks out, so that these are found in the
pictures. They are prepared, trained on (``labels=ph_d model=feedforward``, which the choice takes at this length) and
spoken with, each by its command in a process of its own. Printed are the seconds of every stage that tells how far it
is, those of all else, and of each command the seconds of the processor too. What is in WORK already is removed.
Several lengths at once show how each stage grows: ``--minutes 10 20 40``.
"""

import argparse
import re
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from itertools import chain, count, islice
from pathlib import Path

from claim import Claim, tell

from dnnvss.formats.tables import markdown_table

CLIP = 3.0
"""Seconds of a clip of GRID."""
TOLD = re.compile(r"(?!left out)(?P<stage>.+?): \d+ of \d+ ")
"""A line of a long step."""
GOALS = {False: 25, True: 50}
"""Minutes that an hour is to take at most, with landmarks given, and with landmarks found (``--plain``)."""


def linked(grid: Path, raw: Path, clips: int, plain: bool) -> None:
    """Link so many clips into a new folder; ids that come again get a number."""
    kinds = {"video": ".mp4", "align": ".align"} | ({} if plain else {"landmarks": ".npz"})
    names = sorted(path.stem for path in (grid / "video").glob("*.mp4"))
    again: Iterator[tuple[str, str]] = chain.from_iterable(
        ((name, f"{name}_{turn}" if turn else name) for name in names) for turn in count())
    for kind in kinds:
        (raw / kind).mkdir(parents=True)
    for name, new in islice(again, clips):
        for kind, suffix in kinds.items():
            if (source := (grid / kind / f"{name}{suffix}").resolve()).exists():
                (raw / kind / f"{new}{suffix}").symlink_to(source)
    if not plain:
        shutil.copy(grid / "landmarks.json", raw)


def timed(command: list[str]) -> tuple[dict[str, float], float, float]:
    """Seconds of each stage that a command tells of, of all of it, and of the processor.

    What passes before a line of a stage belongs to that stage, and what passes before another line to ``all else``,
    but for what comes after the line that announces the training of a network.

    Raises:
        SystemExit: the command failed.
    """
    stages: dict[str, float] = {}
    before, used = time.perf_counter(), _processor()
    begun, fitting = before, False
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, bufsize=1)
    assert process.stdout is not None
    tail: list[str] = []
    for line in process.stdout:
        tail = [*tail[-20:], line]
        now, found = time.perf_counter(), TOLD.match(line)
        stage = "fitting the network" if fitting else found["stage"] if found else "all else"
        fitting = line.startswith("training ")
        stages[stage] = stages.get(stage, 0.0) + now - before
        before = now
    if process.wait():
        raise SystemExit(f"{' '.join(command)} failed:\n{''.join(tail)}")
    end = time.perf_counter()
    stages["all else"] = stages.pop("all else", 0.0) + end - before
    return stages, end - begun, _processor() - used


def _processor() -> float:
    """Seconds of the processor that all children have used so far."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def speaking_face(grid: Path, work: Path, minutes: float, plain: bool, jobs: int) -> dict[str, float]:
    """Seconds of each stage from so many minutes of video to a sentence."""
    shutil.rmtree(work, ignore_errors=True)
    linked(grid, work / "raw", round(60 * minutes / CLIP), plain)
    given = ["corpus=grid", "corpus.name=hour", f"corpus.raw={work / 'raw'}", f"corpus.out={work / 'corpus'}"]
    runs = f"runs={work / 'runs'}"
    commands = {
        "prepare": ["-m", "data_prep", *given, f"jobs={jobs}"],
        "train": ["train.py", *given, runs, "labels=ph_d", "model=feedforward", "trainer.progress=false"],
        "speak": ["synth.py", runs, "text=place red at g nine now", f"out={work / 'said.mp4'}"]}
    found: dict[str, float] = {}
    for name, arguments in commands.items():
        stages, wall, used = timed([sys.executable, *arguments])
        found |= {f"{name}: {stage}": seconds for stage, seconds in stages.items()}
        found |= {f"**{name}**": wall, f"**{name}**, of the processor": used}
        print(f"{name}: {wall:.0f} s", file=sys.stderr, flush=True)
    return found | {"**all**": sum(found[f"**{name}**"] for name in commands)}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("grid", type=Path)
    parser.add_argument("work", type=Path)
    parser.add_argument("--minutes", type=float, nargs="+", default=[60])
    parser.add_argument("--plain", action="store_true", help="without landmarks")
    parser.add_argument("--jobs", type=int, default=-1, help="processes of the preparation")
    options = parser.parse_args()
    lengths = {m: speaking_face(options.grid, options.work, m, options.plain, options.jobs) for m in options.minutes}
    stages = list(dict.fromkeys(chain.from_iterable(lengths.values())))
    rows = [[stage, *(f"{own.get(stage, 0.0):.0f}" for own in lengths.values())] for stage in stages]
    print(markdown_table(["seconds", *(f"{m:g} min of video" for m in lengths)], rows))
    kind = "landmarks found" if options.plain else "landmarks given"
    tell(Claim(f"{m:g} minutes of video to a speaking face, {kind}: minutes for an hour of it", own["**all**"] / m,
               GOALS[options.plain]) for m, own in lengths.items())


if __name__ == "__main__":
    main()
