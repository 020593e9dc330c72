"""Viewing tests: what people see, not only what correlates.

    dnnvss viewing make preference runs/A runs/B --out test    render the stimuli; test/page goes to any web host
    dnnvss viewing serve test                                  hand out the lists, take the answers
    dnnvss viewing analyse test/answers                        tables and a page of what was answered
    dnnvss viewing power preference                            how many viewers find which difference

A DESIGN is a file of conf/viewing, or your own such file.
"""

import argparse
import shlex
import textwrap
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from dnnvss import files
from dnnvss.commands.conf import choice_file, choices, conf_folder, read_file
from dnnvss.commands.flags import Flags, whole
from dnnvss.commands.usage import DONE, UsageError
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.viewing.design import Design
from dnnvss.formats.tables import aligned
from dnnvss.progress import counted
from dnnvss.settings import read_settings

_GROUP = "viewing"
_SHOWN = 40
"""Rows of a table that are printed."""
_EVERY = ("", "0.0.0.0", "::")
"""Hosts that stand for all addresses of a machine."""


def read_design(name: str) -> Design:
    """The design of that name, or in that file.

    Raises:
        DnnvssError: there is none, or a setting in it is wrong.
    """
    path = choice_file(_GROUP, name)
    if not path.is_file():
        known = choices([conf_folder()], _GROUP)
        raise UsageError(f"there is no design {name}", remedy=f"Use one of {', '.join(known)}, or a file of your own")
    try:
        return read_settings(Design, read_file(path), "")
    except DnnvssError as error:
        remedy = (error.remedy or "").replace("to the command", "to this file")
        raise DnnvssError(error.problem, file=path, remedy=remedy) from error


def make(options: argparse.Namespace) -> None:
    """Render a test."""
    from dnnvss.evaluation.finished import run_titles
    from dnnvss.evaluation.viewing.making import make_test
    from dnnvss.evaluation.viewing.run_scores import note_test
    from dnnvss.studio.viewing import write_page

    design = read_design(options.design)
    if options.sentences is not None:
        design = replace(design, sentences=options.sentences, per_viewer=min(design.per_viewer, options.sentences))
    if options.seed is not None:
        design = replace(design, seed=options.seed)
    with counted(desc="rendering", unit="stimuli") as bar:
        def told(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        sheet = make_test(design, options.runs, run_titles(options.runs), options.out, options.jobs, told)
    for folder in note_test(sheet, options.out):
        print(f"{folder} cannot be written: viewers' scores will not be left there")
    page, out = write_page(options.out), shlex.quote(str(options.out))
    print(f"{len(sheet.stimuli)} stimuli, {len(sheet.lists)} lists of {len(sheet.lists[0])} trials\n"
          f"wrote {page}: open it, put its folder on a web host, or: dnnvss viewing serve {out}\n"
          f"{options.out / 'key.json'} says what each stimulus is: keep it from viewers")


def serve(options: argparse.Namespace) -> None:
    """Serve a test until Ctrl-C."""
    from dnnvss.studio.server import Server
    from dnnvss.studio.viewing import ViewingDesk

    if options.host in _EVERY and not options.name:
        raise UsageError(f"--host {options.host} is every address of this machine, and viewers would be refused",
                         remedy="Name the one that they open: --name 192.168.0.7:8767, say")
    desk = ViewingDesk(options.test, options.most)
    with Server(desk.page(), options.port, options.host, names=options.name) as server:
        print(f"{len(desk.sheet.lists)} lists, {desk.count} answers so far; open {server.url} (Ctrl-C ends)",
              flush=True)
        with suppress(KeyboardInterrupt):
            server.wait()
    print(f"\n{desk.count} answers lie in {options.test / 'answers'}; now: "
          f"dnnvss viewing analyse {shlex.quote(str(options.test / 'answers'))}")


def analyse(options: argparse.Namespace) -> None:
    """Print and write what may be concluded from answers."""
    from dnnvss.evaluation.viewing.analysis import analyse as concluded
    from dnnvss.evaluation.viewing.answers import answer_files, receive
    from dnnvss.evaluation.viewing.report import lead, write_report
    from dnnvss.evaluation.viewing.run_scores import leave_scores
    from dnnvss.evaluation.viewing.sheet import KEY, Sheet

    answers: Path = options.answers / "answers" if (options.answers / KEY).is_file() else options.answers
    test = options.test or answers.resolve().parent
    sent = answer_files(answers)
    if not (test / KEY).is_file():
        raise DnnvssError(f"is the folder of no test: it has no {KEY}", file=test,
                          remedy="Name the folder that dnnvss viewing make wrote: --test FOLDER")
    sheet = Sheet.open(test)
    received = receive(sheet, sent)
    for name, why in sorted(received.refused.items()):
        print(f"refused {name!r}: {why}")
    result = concluded(sheet, received)
    for name, why in sorted(result.left_out.items()):
        print(f"left out {name!r}: {why}")
    print(lead(result))
    for warning in result.warnings:
        print(f"warning: {warning}")
    for table in result.tables:
        print(f"\n{table.title}\n{aligned([*table.head], [list(row) for row in table.rows[:_SHOWN]])}")
        for note in table.notes:
            print(textwrap.fill(note, 100))
    written = write_report(result, options.out or test)
    left = leave_scores(result, files.digest(test / KEY))
    print(f"\nwrote {written.text}, {written.data}, and {written.page}: open it in a browser"
          + (f"; comparisons of these runs will show the scores: {', '.join(map(str, left))}" if left else ""))


def power(options: argparse.Namespace) -> None:
    """Print how many viewers find which difference."""
    from dnnvss.evaluation.viewing.power import WANTED, Viewers, fewest, power_table

    design = read_design(options.design)
    scored = design.scored
    effects = options.effect or ([5.0, 10.0, 15.0, 20.0] if scored else [0.55, 0.6, 0.65, 0.7, 0.8])
    if bad := [e for e in effects if not scored and not 0 <= e <= 1]:
        raise UsageError(f"--effect={bad[0]:g} is no share", remedy="Give shares for the better one, such as 0.6")
    assumed = Viewers(options.trials or design.per_viewer, options.spread if options.spread is not None else
                      10.0 if scored else 0.1, options.noise, options.careless)
    table = power_table(options.viewers, effects, assumed, not scored, options.seed)
    unit = "points of 100" if scored else "true share for the better one"
    print(f"Share of tests that find it (p < .05, t test over viewers), by viewers and {unit}; {assumed.trials} "
          f"judgements each,\nviewers' own spread {assumed.spread:g}"
          + (f", noise of a judgement {assumed.noise:g}" if scored else "") + f", {assumed.careless:.0%} careless. "
          "These are assumptions; simulated viewers are no result.\n")
    rows = [[str(n), *[f"{value:.2f}" for value in row]] for n, row in zip(options.viewers, table, strict=True)]
    least = [str(n) if n else f"> {max(options.viewers)}" for n in fewest(table, options.viewers)]
    print(aligned(["viewers", *[f"{e:g}" for e in effects]], [*rows, [f"for {WANTED:.0%}", *least]]))


def _numbers(kind: Callable[[str], float], least: float, most: float) -> Callable[[str], list[float]]:
    """A type of option: numbers with commas between them, in increasing order."""
    def parse(text: str) -> list[float]:
        try:
            found = sorted(kind(part) for part in text.split(","))
        except ValueError as error:
            raise argparse.ArgumentTypeError(f"={text} are no numbers") from error
        if not all(least <= value <= most for value in found):
            raise argparse.ArgumentTypeError(f"={text} is out of range: {least:g} to {most:g}")
        return found

    return parse


def _number(least: float, most: float) -> Callable[[str], float]:
    def parse(text: str) -> float:
        return _numbers(float, least, most)(text)[0]

    return parse


def main(arguments: Sequence[str]) -> int:
    """Run one of the commands."""
    parser = Flags(prog="dnnvss viewing", description=__doc__)
    add = parser.commands()
    maker = add("make", make, "render the stimuli of a test and write its page")
    maker.add_argument("design", metavar="DESIGN",
                       help=f"{', '.join(choices([conf_folder()], _GROUP))}, or a file of your own")
    maker.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="folder of a finished run")
    maker.add_argument("--out", type=Path, default=Path("viewing"), help="folder to write (viewing)")
    maker.add_argument("--sentences", type=whole(1, 1000), help="how many sentences; those of the design unless given")
    maker.add_argument("--seed", type=whole(0, 2**31),
                       help="of sentences, orders and noise; that of the design unless given")
    maker.add_argument("--jobs", type=whole(1), default=1, help="processes that render (1)")
    server = add("serve", serve, "serve a test: hand out its lists, take the answers")
    server.add_argument("test", type=Path, metavar="TEST", help="the folder that `dnnvss viewing make` wrote")
    server.add_argument("--port", type=whole(0, 65535), default=8767, help="0 takes a free one (8767)")
    server.add_argument("--host", default="127.0.0.1", help="address to listen on (this machine alone)")
    server.add_argument("--name", action="append", default=[], metavar="NAME[:PORT]",
                        help="another name by which viewers reach it, through a proxy; may be given again")
    server.add_argument("--most", type=whole(1), default=10_000,
                        help="answers from which no more are taken (10000)")
    analyser = add("analyse", analyse, "tables and a page of what was answered")
    analyser.add_argument("answers", type=Path, metavar="ANSWERS", help="folder of answers, or the folder of the test")
    analyser.add_argument("--test", type=Path, help="folder of the test; the one around ANSWERS unless given")
    analyser.add_argument("--out", type=Path, help="folder to write; that of the test unless given")
    planner = add("power", power, "how many viewers find which difference, by simulation")
    planner.add_argument("design", metavar="DESIGN", help="name or file")
    planner.add_argument("--viewers", type=_numbers(int, 2, 1000), default=[10, 15, 20, 30, 40, 60],
                         help="numbers of viewers (10,15,20,30,40,60)")
    planner.add_argument("--effect", type=_numbers(float, 0, 100),
                         help="true shares (0.55,0.6,0.65,0.7,0.8), or differences in points (5,10,15,20)")
    planner.add_argument("--trials", type=whole(1, 1000),
                         help="judgements of one comparison by a viewer (per_viewer of the design); of three systems "
                              "a third")
    planner.add_argument("--spread", type=_number(0, 100),
                         help="standard deviation over viewers of their own share (0.1) or difference (10 points)")
    planner.add_argument("--noise", type=_number(0, 100), default=20.0,
                         help="standard deviation of a judgement of a difference in points (20)")
    planner.add_argument("--careless", type=_number(0, 1), default=0.0, help="share who answer at random (0)")
    planner.add_argument("--seed", type=whole(0), default=0, help="of the simulation (0)")
    options = parser.read(arguments)
    options.work(options)
    return DONE
