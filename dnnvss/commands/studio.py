"""``dnnvss studio [RUNS]``: type or speak, and watch: pages on this machine, and a service under them.

Serves the finished runs in a folder; where there is none yet, the page offers to make the built-in talker. Beside it
are pages of footage, labels, heads, training, results and viewing tests.
Other machines get in by --host alone, with a token: that of the environment variable DNNVSS_TOKEN, else one that is
made and printed.
"""

import os
import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_urlsafe

from dnnvss.commands.flags import Flags, whole
from dnnvss.commands.usage import DONE
from dnnvss.errors import DnnvssError
from dnnvss.runs.files import RunFiles
from dnnvss.style.generator import StyleSettings

FOLDERS = ("data", "labels", "heads", "viewing")
"""Where commands write corpora, labels, points of heads and viewing tests unless told otherwise."""
_TOKEN, _SHORTEST = "DNNVSS_TOKEN", 16
"""The variable of the environment that may hold the token, and how many letters it has at least."""


def flags() -> Flags:
    """What the command takes."""
    parser = Flags(prog="dnnvss studio", description=__doc__)
    parser.add_argument("runs", nargs="?", type=Path, default=Path("runs"), metavar="RUNS",
                        help="a folder of run folders (runs)")
    parser.add_argument("--port", type=whole(0, 65535), default=8766, help="of 127.0.0.1; 0 takes a free one (8766)")
    parser.add_argument("--host", default="127.0.0.1", help="the address to listen on (127.0.0.1); with another one "
                        "other machines get in who bring the token, which is printed")
    parser.add_argument("--name", action="append", default=[], help="a further name under which "
                        "it is reached, with its port where that is not the usual one, such as face.example:8766")
    parser.add_argument("--folder", action="append", type=Path, metavar="FOLDER", help="a folder whose corpora, "
                        f"labels, viewing tests and comparisons are listed; may be given again ({', '.join(FOLDERS)})")
    parser.add_argument("--workers", type=whole(1, 64), default=_workers(), help="processes that say and draw "
                        f"({_workers()}); each holds about half a gigabyte")
    parser.add_argument("--waiting", type=whole(0, 10_000), default=64, help="requests that wait for a worker; further "
                        "ones are told to come again (64)")
    parser.add_argument("--seconds", type=whole(1, 36_000), default=120, help="that one request may take (120)")
    parser.add_argument("--log", type=Path, metavar="FILE", help="a line of JSON for each request; - for the terminal")
    parser.add_argument("--log-texts", action="store_true", help="what is said stands in the log, too")
    return parser


def main(arguments: Sequence[str]) -> int:
    """Serve the page until Ctrl-C."""
    options = flags().read(arguments)
    from dnnvss.studio.areas import with_areas
    from dnnvss.studio.pool import PoolLimits
    from dnnvss.studio.requests import Requests
    from dnnvss.studio.server import Server
    from dnnvss.studio.speaking import SpeakingDesk

    _check_runs(options.runs)
    token, made = _token(options.host)
    limits = PoolLimits(options.workers, options.waiting, working=options.seconds)
    requests = Requests(options.log, options.log_texts)
    desk = SpeakingDesk(options.runs, styles(), limits, requests)
    try:
        folders = options.folder or [Path(name) for name in FOLDERS]
        page = with_areas(desk.page(), options.runs, folders)
        with Server(page, options.port, options.host, token=token, names=options.name) as server:
            print(f"open {server.url}{f'?token={token}' if made else ''} (Ctrl-C ends); the service is described at "
                  f"{server.url}v1/openapi.json", flush=True)
            with _ended_by_sigterm(), suppress(KeyboardInterrupt):
                server.wait()
    finally:
        desk.close()
    return DONE


def _check_runs(runs: Path) -> None:
    """Refuse what is no folder of runs; one that is not there yet is made with the built-in talker.

    Raises:
        DnnvssError: a file, or a run itself.
    """
    if runs.exists() and not runs.is_dir():
        raise DnnvssError("is no folder of runs", file=runs, remedy="Give the folder that holds runs")
    if RunFiles(runs).config.is_file():
        raise DnnvssError("is a run itself", file=runs,
                          remedy=f"Give the folder that holds it: dnnvss studio {runs.absolute().parent}")


@contextmanager
def _ended_by_sigterm() -> Iterator[None]:
    """Let what supervisors send end the block as Ctrl-C does, so that nothing is left behind."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _workers() -> int:
    """A process for each processor that this one may use, four at most."""
    usable = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1)
    return min(4, len(usable))


def _token(host: str) -> tuple[str | None, bool]:
    """What others have to bring, and whether it was made just now; None where this machine alone gets in.

    Raises:
        DnnvssError: the one that is given can be guessed.
    """
    if host == "127.0.0.1":
        return None, False
    if not (given := os.environ.pop(_TOKEN, "")):  # what this one starts need not know it
        return token_urlsafe(18), True
    if len(given) < _SHORTEST or not given.isascii():
        raise DnnvssError(f"the token in {_TOKEN} is shorter than {_SHORTEST} letters, or not plain ASCII",
                          remedy="Give a longer one that nobody can guess, or none: then one is made")
    return given, False


def styles() -> dict[str, StyleSettings]:
    """Every style of ``conf/style`` by its name."""
    from dnnvss.commands.conf import choices, conf_folder
    from dnnvss.commands.speak import named_style

    names = sorted(choices([conf_folder()], "style"), key=lambda name: name != "articulated")
    return {name: named_style(name) for name in names}
