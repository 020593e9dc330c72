"""``dnnvss features ph``: a feature table as Markdown: level, width, slice and source of its blocks.

Without labels it prints the whole page on features, ``docs/features.md``, from all configurations.
"""

from collections.abc import Sequence
from pathlib import Path

from dnnvss.commands.conf import choice_file, choices, conf_folder, read_choice
from dnnvss.commands.flags import Flags, given_as
from dnnvss.commands.usage import DONE
from dnnvss.errors import DnnvssError
from dnnvss.timing import FrameClock


def main(arguments: Sequence[str]) -> int:
    """Print what the arguments ask for."""
    parser = Flags(prog="dnnvss features", description=__doc__)
    parser.add_argument("files", nargs="*", type=lambda named: choice_file("labels", named), metavar="LABELS",
                        help=f"{', '.join(choices([conf_folder()], 'labels'))}, or files of your own")
    parser.add_argument("--rate", type=given_as(FrameClock), default=FrameClock(100),
                        help="frames a second, to state windows in milliseconds (100)")
    parser.add_argument("--conf", type=Path, default=conf_folder() / "labels",
                        help="folder of all configurations, for the page (conf/labels)")
    options = parser.read(arguments)
    from dnnvss.features import FeatureTable
    from dnnvss.features.page import features_page, table_page

    found = options.files or sorted(options.conf.glob("*.yaml"))
    if not found:
        raise DnnvssError("holds no configuration", file=options.conf, remedy="Give a folder such as conf/labels")
    tables = [(file.stem, FeatureTable.from_config(read_choice(file))) for file in found]
    if options.files:
        pages = [table_page(name, table, options.rate) for name, table in tables]
    else:
        pages = [features_page(dict(tables))]
    print("\n".join(pages), end="")
    return DONE
