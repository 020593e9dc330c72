"""``dnnvss points MESH --out FOLDER``: the packaged head's points on a mesh of yours, guessed, drawn, set by hand.

The guess is drawn in FOLDER/points.png, to be looked at; --page serves a page on which points are dragged. FOLDER may
be opened again without MESH. `dnnvss rig --points FOLDER/points.json` takes what comes of it.
"""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from dnnvss.commands.flags import Flags, whole
from dnnvss.commands.usage import DONE
from dnnvss.errors import DnnvssError

if TYPE_CHECKING:
    from dnnvss.face.mesh.pointing import HeadPoints


def main(arguments: Sequence[str]) -> int:
    """Guess, draw, and serve the page where it is asked for."""
    parser = Flags(prog="dnnvss points", description=__doc__)
    parser.add_argument("mesh", type=Path, nargs="?", metavar="MESH", help=".obj, .glb or .gltf")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="that holds the points")
    parser.add_argument("--again", action="store_true", help="guess anew where FOLDER holds points already")
    parser.add_argument("--page", action="store_true", help="serve the page on which points are dragged")
    parser.add_argument("--port", type=whole(0, 65535), default=8767, help="of 127.0.0.1; 0 takes a free one (8767)")
    options = parser.read(arguments)
    points = _points(options.mesh, options.out, options.again)
    _draw(points)
    if options.page:
        _serve(options.out, options.port)
    return DONE


def _points(mesh: Path | None, folder: Path, again: bool) -> "HeadPoints":
    from dnnvss.face.mesh.pointing import NAME, HeadPoints, begin

    if (folder / NAME).is_file() and not again:
        points = HeadPoints.open(folder)
        if mesh is not None and mesh.resolve() != points.path.resolve():
            raise DnnvssError(f"holds the points of {points.path}", file=folder,
                              remedy="Give another --out, or --again to guess anew")
        print(f"{len(points.points)} points in {folder}, {len(points.placed)} set by hand")
        return points
    if mesh is None:
        raise DnnvssError("holds no points yet", file=folder, remedy="dnnvss points MESH --out FOLDER")
    points, said = begin(mesh, folder)
    print(f"{mesh}: {said}")
    if not points.guessed:
        print(f"set them by hand: dnnvss points --out {folder} --page")
    return points


def _draw(points: "HeadPoints") -> None:
    from dnnvss.face.mesh.guess import turned
    from dnnvss.face.mesh.pointing import PICTURE, straightened
    from dnnvss.render.head_points import draw_points

    mesh = points.mesh()
    turn = straightened(mesh, points.points)
    path = points.folder / PICTURE
    draw_points(path, turned(mesh, turn), {name: turn @ place for name, place in points.points.items()})
    print(f"look at {path}")


def _serve(folder: Path, port: int) -> None:
    """Serve the page until Ctrl-C, and draw what came of it."""
    from dnnvss.face.mesh.pointing import HeadPoints
    from dnnvss.studio.heads import HeadDesk, next_command
    from dnnvss.studio.server import Server

    with Server(HeadDesk(folder).page(), port) as server:
        print(f"open {server.url} (Ctrl-C ends)", flush=True)
        with suppress(KeyboardInterrupt):
            server.wait()
    points = HeadPoints.open(folder)
    print(f"\n{len(points.placed)} points were set by hand; all is saved; now: {next_command(points)}")
    _draw(points)
