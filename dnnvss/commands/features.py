"""Print feature tables as Markdown.

``python -m dnnvss features conf/labels/ph.yaml`` prints the table of a configuration: its blocks with level, width,
slice and source. Without a file it prints the whole page on features, ``docs/features.md``, from all configurations.
"""

import argparse
import sys
from pathlib import Path

from dnnvss.errors import DnnvssError
from dnnvss.features.page import features_page, read_table, table_page
from dnnvss.timing import FrameClock


def main(arguments: list[str] | None = None) -> int:
    """Print what the arguments ask for and return 0, or an error and 1."""
    parser = argparse.ArgumentParser(prog="python -m dnnvss features", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", help="files of conf/labels")
    parser.add_argument("--rate", default="100", help="frames a second, to state windows in milliseconds")
    parser.add_argument("--conf", default="conf/labels", help="folder of all configurations, for the page")
    options = parser.parse_args(arguments)
    try:
        clock = FrameClock(options.rate)
        if options.files:
            pages = [table_page(Path(f).stem, read_table(f), clock) for f in options.files]
        else:
            found = sorted(Path(options.conf).glob("*.yaml"))
            if not found:
                raise DnnvssError("holds no configuration", file=options.conf,
                                  remedy="Run it from the repository's root")
            pages = [features_page({f.stem: read_table(f) for f in found})]
    except DnnvssError as error:
        print(error, file=sys.stderr)
        return 1
    print("\n".join(pages), end="")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
