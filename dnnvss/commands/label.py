"""Frames labelled by hand.

    dnnvss label choose VIDEOS --count 30 --out labels/ [--scheme lips_jaw_nostrils]
    dnnvss label page labels/                       drag the points in the browser
    dnnvss label import labels/ --from file.json    LabelMe, COCO keypoints (CVAT), VIA
    dnnvss label check labels/                      what is unfinished or looks wrong
"""

import argparse
import shlex
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from dnnvss.commands.flags import Flags, whole
from dnnvss.commands.usage import DONE
from dnnvss.errors import DnnvssError
from dnnvss.face.aam.labelling.doubts import doubts
from dnnvss.face.aam.labelling.imports import import_into
from dnnvss.face.aam.labelling.schemes import SCHEMES, find_scheme
from dnnvss.face.aam.labelling.sheet import Sheet

LABELS = "the folder that `dnnvss label choose` wrote"


def choose(options: argparse.Namespace) -> None:
    """Export the frames to label."""
    from dnnvss.face.aam.labelling.export import export

    scheme = find_scheme(options.scheme)
    sheet, placed = export(options.folder, options.count, options.out, scheme, options.seed)
    print(f"{scheme.name}: {scheme.title}")
    for how, count in placed.items():
        print(f"{count} guesses placed by: {how}")
    print(f"wrote {len(sheet.labels)} frames to {options.out}; now: dnnvss label page {shlex.quote(str(options.out))}")


def page(options: argparse.Namespace) -> None:
    """Serve the page until Ctrl-C."""
    from dnnvss.studio.labelling import LabelDesk, next_command
    from dnnvss.studio.server import Server

    sheet = Sheet.open(options.folder)
    with Server(LabelDesk(options.folder).page(), options.port) as server:
        print(f"{len(sheet.labels)} frames, {len(sheet.done)} finished; open {server.url} (Ctrl-C ends)", flush=True)
        with suppress(KeyboardInterrupt):
            server.wait()
    sheet = Sheet.open(options.folder)
    print(f"\n{len(sheet.done)} of {len(sheet.labels)} frames are finished; all is saved"
          + (f"; now: {next_command(sheet)}" if len(sheet.done) == len(sheet.labels) else ""))


def take(options: argparse.Namespace) -> None:
    """Read what another tool wrote."""
    sheet, names = import_into(Sheet.open(options.folder), options.source)
    print(f"wrote {len(names)} labels to {options.folder}; {len(sheet.done)} of {len(sheet.labels)} are finished")


def check(options: argparse.Namespace) -> None:
    """Print the doubtful labels; there are none, or the command ends with an error."""
    sheet = Sheet.open(options.folder)
    found = doubts(sheet)
    for doubt in found:
        print(f"{doubt.image}: {doubt.problem}")
    if found:
        raise DnnvssError(f"{len({d.image for d in found})} of {len(sheet.labels)} labels need a look",
                          file=options.folder,
                          remedy=f"Look at them on the page: dnnvss label page {shlex.quote(str(options.folder))}")
    from dnnvss.studio.labelling import next_command

    print(f"all {len(sheet.labels)} labels are finished, and none looks wrong; now: {next_command(sheet)}")


def main(arguments: Sequence[str]) -> int:
    """Run one of the commands."""
    parser = Flags(prog="dnnvss label", description=__doc__)
    add = parser.commands()
    chooser = add("choose", choose, "export the frames that are worth labelling, with starting guesses")
    chooser.add_argument("folder", type=Path, metavar="VIDEOS", help="folder of videos, or one video")
    chooser.add_argument("--count", type=whole(1), default=30, help="how many frames (30)")
    chooser.add_argument("--out", type=Path, default=Path("labels"), help="folder to write (labels)")
    chooser.add_argument("--scheme", default="lips_jaw_nostrils",
                         help=f"points to label: {', '.join(SCHEMES)} (the first)")
    chooser.add_argument("--seed", type=whole(0), default=0, help="another number, other frames (0)")
    pager = add("page", page, "serve the page on which the points are dragged")
    pager.add_argument("folder", type=Path, metavar="LABELS", help=LABELS)
    pager.add_argument("--port", type=whole(0, 65535), default=8765, help="of 127.0.0.1; 0 takes a free one (8765)")
    taker = add("import", take, "read the JSON of LabelMe, COCO keypoints (CVAT) or VIA")
    taker.add_argument("folder", type=Path, metavar="LABELS", help=LABELS)
    taker.add_argument("--from", dest="source", type=Path, required=True, metavar="JSON",
                       help="file, or folder of files")
    checker = add("check", check, "list labels that are unfinished or look wrong")
    checker.add_argument("folder", type=Path, metavar="LABELS", help=LABELS)
    options = parser.read(arguments)
    options.work(options)
    return DONE
