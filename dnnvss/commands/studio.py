"""``dnnvss studio [RUNS]``: type or speak, and watch: a page on this machine, and a service under it.

Serves the finished runs in a folder. Where there is none yet, the page offers to make the built-in talker.
"""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from dnnvss.commands.flags import Flags, whole
from dnnvss.commands.usage import DONE
from dnnvss.style.generator import StyleSettings


def main(arguments: Sequence[str]) -> int:
    """Serve the page until Ctrl-C."""
    parser = Flags(prog="dnnvss studio", description=__doc__)
    parser.add_argument("runs", nargs="?", type=Path, default=Path("runs"), metavar="RUNS",
                        help="a folder of run folders (runs)")
    parser.add_argument("--port", type=whole(0, 65535), default=8766, help="of 127.0.0.1; 0 takes a free one (8766)")
    options = parser.read(arguments)
    from dnnvss.studio.server import Server
    from dnnvss.studio.speaking import SpeakingDesk

    desk = SpeakingDesk(options.runs, styles())
    try:
        with Server(desk.page(), options.port) as server:
            print(f"open {server.url} (Ctrl-C ends); the service is described at {server.url}v1/openapi.json",
                  flush=True)
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
