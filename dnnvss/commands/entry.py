"""The one way into every command: ``dnnvss COMMAND``, ``python -m dnnvss COMMAND``, and the programs at the root."""

import difflib
import gc
import io
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from types import ModuleType

from dnnvss import __version__, headroom
from dnnvss.commands.usage import DONE, UsageError, guarded

COMMANDS = {
    "prepare": "a corpus from recordings: videos, their words and their landmarks",
    "train": "a system on a corpus: trains, evaluates the test split, writes a run folder",
    "speak": "text, a voice or phone times as a talking face, by a trained run",
    "studio": "type or speak in the browser, watch, change and take away; a service for programs",
    "live": "a face that moves while somebody speaks, by a run of a network with a look-ahead",
    "compare": "finished runs in one table, with confidence intervals and a page",
    "outside": "a run judged from outside: one tracker over the talker's video and over ours",
    "unseen": "how well a run's system says words that it never heard, over random splits",
    "rig": "a take of named curves on a head: video, glTF, Live Link Face",
    "points": "where the head's points lie on a mesh of yours: guessed, drawn, dragged in the browser",
    "export": "a run's network as a file, or all of the run as a bundle",
    "label": "frames labelled by hand: choose, page, import, check",
    "track": "the points of every frame of videos, from about thirty labelled ones",
    "figure": "coefficients of a test sentence, measured and predicted by runs",
    "face-figures": "what a face model has learnt, and how well it sees its talker",
    "correlations": "how much of what is seen can be heard: canonical correlations of features and a face",
    "viewing": "viewing tests: make, serve, analyse, power",
    "units": "what the dynamic visemes of a run look like",
    "visemes": "measurements of gestures and dynamic visemes of a corpus",
    "features": "the feature tables as Markdown",
}
"""Each command and what it is about. Its module, of the same name, has ``main(arguments) -> status``."""


@guarded
def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command that the arguments name and return its status.

    Args:
        arguments: the command and what it is given; those of the process where None.

    Raises:
        SystemExit: a mistake, told in one line on standard error: status 2 where the command line cannot be understood,
            1 for all else, 130 for Ctrl-C.
    """
    _settle()
    words = list(sys.argv[1:] if arguments is None else arguments)
    if not words or words[0] in ("-h", "--help", "help"):
        print(_overview())
        return DONE
    if words[0] == "--version":
        print(f"dnnvss {__version__}")
        return DONE
    if words[0] not in COMMANDS:
        raise _unknown(words[0])
    status: int = _module(words[0].replace("-", "_")).main(words[1:])
    return status


def _module(name: str) -> ModuleType:
    """The module of a command, with all that it imports, where the limits of the process leave room for that.

    Nothing of that is garbage: it is not looked through while modules are read, which was a tenth of the start,
    nor ever again.
    """
    headroom.for_libraries()
    gc.disable()
    try:
        module = import_module(f"dnnvss.commands.{name}")
    finally:
        gc.freeze()
        gc.enable()
    headroom.for_products()
    return module


def _settle() -> None:
    """Let no environment decide whether a command ends well.

    Figures are only saved, so that a notebook's backend is of no use here; what a console cannot show is escaped.
    Threads of OpenMP that wait for work go to sleep after half a millisecond, unless the environment says otherwise: by
    default they spin for so long that beside programs which keep the cores busy a step of a small network took 15 to 40
    times as long. Sleeping at once costs a network that is alone on the machine half as much time again. It is read
    when torch is loaded, and so comes before.
    """
    os.environ["MPLBACKEND"] = "agg"
    if "OMP_WAIT_POLICY" not in os.environ:
        os.environ.setdefault("GOMP_SPINCOUNT", "10000")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _overview() -> str:
    width = max(map(len, COMMANDS))
    lines = [f"  {name:<{width}}  {about}" for name, about in COMMANDS.items()]
    return "\n".join(["usage: dnnvss COMMAND ...", "", *lines, "", "dnnvss COMMAND --help says what a command takes."])


def _unknown(word: str) -> UsageError:
    near = difflib.get_close_matches(word, COMMANDS, 1)
    meant = f"Did you mean {near[0]}?" if near else f"Use one of {', '.join(COMMANDS)}"
    return UsageError(f"{word} is no command", remedy=meant)
