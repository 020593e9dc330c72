"""``dnnvss features conf/labels/ph.yaml``: a feature table as Markdown: level, width, slice and source of its blocks.

Without a file it prints the whole page on features, ``docs/features.md``, from all configurations.
"""

from collections.abc import Sequence
from pathlib import Path

from dnnvss.commands.conf import conf_folder
from dnnvss.commands.flags import Flags, given_as
from dnnvss.commands.usage import DONE
from dnnvss.errors import DnnvssError
from dnnvss.timing import FrameClock


def main(arguments: Sequence[str]) -> int:
    """Print what the arguments ask for."""
    parser = Flags(prog="dnnvss features", description=__doc__)
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE", help="files of conf/labels")
    parser.add_argument("--rate", type=given_as(FrameClock), default=FrameClock(100),
                        help="frames a second, to state windows in milliseconds (100)")
    parser.add_argument("--conf", type=Path, default=conf_folder() / "labels",
                        help="folder of all configurations, for the page (conf/labels)")
    options = parser.read(arguments)
    from dnnvss.features.page import features_page, read_table, table_page

    if options.files:
        pages = [table_page(file.stem, read_table(file), options.rate) for file in options.files]
    else:
        found = sorted(options.conf.glob("*.yaml"))
        if not found:
            raise DnnvssError("holds no configuration", file=options.conf, remedy="Give a folder such as conf/labels")
        pages = [features_page({file.stem: read_table(file) for file in found})]
    print("\n".join(pages), end="")
    return DONE
