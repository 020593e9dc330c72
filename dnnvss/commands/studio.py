"""``dnnvss studio [RUNS]``: type or speak, and watch: pages on this machine, and a service under them.

Serves the finished runs in a folder; where there is none yet, the page offers to make the built-in talker. Beside it
are pages of footage, labels, training, results and viewing tests.
"""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from secrets import token_urlsafe

from dnnvss.commands.flags import Flags, whole
from dnnvss.commands.usage import DONE
from dnnvss.style.generator import StyleSettings

FOLDERS = ("data", "labels", "viewing")
"""Where commands write corpora, labels and viewing tests unless told otherwise."""


def main(arguments: Sequence[str]) -> int:
    """Serve the page until Ctrl-C."""
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
    options = parser.read(arguments)
    from dnnvss.studio.areas import with_areas
    from dnnvss.studio.server import Server
    from dnnvss.studio.speaking import SpeakingDesk

    token = None if options.host == "127.0.0.1" else token_urlsafe(18)
    desk = SpeakingDesk(options.runs, styles())
    try:
        folders = options.folder or [Path(name) for name in FOLDERS]
        page = with_areas(desk.page(), options.runs, folders)
        with Server(page, options.port, options.host, token=token, names=options.name) as server:
            print(f"open {server.url}{f'?token={token}' if token else ''} (Ctrl-C ends); the service is described at "
                  f"{server.url}v1/openapi.json", flush=True)
            with suppress(KeyboardInterrupt):
                server.wait()
    finally:
        desk.close()
    return DONE


def styles() -> dict[str, StyleSettings]:
    """Every style of ``conf/style`` by its name."""
    from dnnvss.commands.arguments import parse_arguments
    from dnnvss.commands.compose import compose
    from dnnvss.commands.composed import typed_settings
    from dnnvss.commands.conf import choices, conf_folder
    from dnnvss.commands.speak import COMMAND

    names = sorted(choices([conf_folder()], "style"), key=lambda name: name != "articulated")
    return {name: typed_settings(COMMAND, compose(parse_arguments(COMMAND, [f"style={name}"]))).style
            for name in names}
