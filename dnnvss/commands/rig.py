"""``dnnvss rig TAKE --out FILE``: a take of named curves on a head: as video, glTF, or as curves at another rate."""

import sys
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dnnvss import files
from dnnvss.commands.flags import Flags
from dnnvss.commands.usage import DONE
from dnnvss.errors import DnnvssError

if TYPE_CHECKING:
    from dnnvss.export.take import Take
    from dnnvss.face.mesh import Head

_VIDEO = ".mp4"


def main(arguments: Sequence[str]) -> int:
    """Show or write what the command line asks for."""
    options = _flags().read(arguments)
    if options.names:
        from dnnvss.face.mesh.net import packaged_net

        print("\n".join(packaged_net().names))
        return DONE
    if options.take is None or not options.out:
        raise DnnvssError("dnnvss rig needs a take and --out", remedy="dnnvss rig TAKE.csv --out take.mp4")
    _check(options.out, options.height, options.turn)
    files.check_writable(options.out)
    read = [p for p in (options.take, options.head, options.points, options.sound) if p]
    files.check_apart(options.out, read)
    _write(options)
    return DONE


def _flags() -> Flags:
    """What the command line may hold."""
    parser = Flags(prog="dnnvss rig", description=__doc__)
    parser.add_argument("take", type=Path, nargs="?", metavar="TAKE",
                        help="Live Link Face's CSV, a CSV of named curves, or a take.json")
    parser.add_argument("--head", type=Path, metavar="MESH", help="another head: .obj, .glb or .gltf")
    parser.add_argument("--points", type=Path, metavar="FILE.json",
                        help="some of the mesh's points by name: a vertex's number or a place")
    parser.add_argument("--names", action="store_true", help="list the names that --points may give")
    parser.add_argument("--out", type=Path, nargs="+", default=[], metavar="FILE",
                        help=".mp4, .glb, .csv (Live Link Face) or .json")
    parser.add_argument("--rate", help="frames a second; those of the take where it is not given")
    parser.add_argument("--timecode", help="of the first frame, hours:minutes:seconds:frame")
    parser.add_argument("--sound", type=Path, help="heard in the video")
    parser.add_argument("--height", type=int, default=480, help="of the video in pixels")
    parser.add_argument("--turn", type=float, default=0.0, help="degrees by which the head is turned")
    return parser


def _check(outputs: Sequence[Path], height: int, turn: float) -> None:
    from dnnvss.export.take import check_take_file

    for path in outputs:
        if path.suffix.lower() != _VIDEO:
            check_take_file(path, others=[_VIDEO])
    if not 16 <= height <= 4320:
        raise DnnvssError(f"--height {height} is no size of a picture", remedy="Give 16 to 4320")
    if not -360 <= turn <= 360:
        raise DnnvssError(f"--turn {turn:g} is no angle", remedy="Give -360 to 360 degrees")


def _write(options: Namespace) -> None:
    from dataclasses import replace

    from dnnvss.export.take import write_take
    from dnnvss.export.take_read import read_take
    from dnnvss.export.timecode import TimeCode
    from dnnvss.timing import FrameClock

    given = vars(options)
    clock = FrameClock.from_setting(given["rate"], "--rate") if given["rate"] else None
    take = read_take(given["take"], clock)
    if given["timecode"]:
        take = replace(take, start=TimeCode.from_setting(given["timecode"], "--timecode"))
        take.start.base(take.clock)  # refused before a video is drawn
    moved = any(path.suffix.lower() in (_VIDEO, ".glb") for path in given["out"])
    if moved:
        take = replace(take, head=_head(given["head"], given["points"]))
    for path in given["out"]:
        if path.suffix.lower() == _VIDEO:
            _film(path, take, given)
        else:
            write_take(path, take)
        print(
            f"wrote {path}: {take.frames} frames, {take.clock} a second, from {take.start}",
            file=sys.stdout,
        )


def _head(path: Path | None, points: Path | None) -> "Head":
    """The head that the take moves: the packaged one, or a mesh with its own or the packaged head's shapes."""
    from dnnvss.face.mesh import packaged_head
    from dnnvss.face.mesh.other import open_head

    if path is None:
        return packaged_head()
    head, remark = open_head(path, points)
    print(remark)
    return head


def _film(path: Path, take: "Take", given: dict[str, Any]) -> None:
    from dnnvss.face.mesh.turns import Turns
    from dnnvss.media import SOUND_RATE, read_audio, write_video
    from dnnvss.progress import counted
    from dnnvss.render.solid import Solid, whole_head

    assert take.head is not None
    head, weights = take.head, take.head.weights(take.curves)
    turns = Turns.of(head.mesh, take.curves)
    camera = whole_head(head.mesh, given["height"], given["turn"], turns)
    frames = Solid(head.mesh, camera, smooth=2).frames(head.moved(weights, turns))
    samples = read_audio(given["sound"], SOUND_RATE) if given["sound"] else None
    with counted(frames, "rendering", unit="pictures") as bar:
        write_video(path, bar, take.clock.rate, samples, SOUND_RATE)
