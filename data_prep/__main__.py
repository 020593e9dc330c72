"""``python -m data_prep corpus=NAME corpus.raw=RAW``: prepares a corpus; settings in ``conf/prepare.yaml``."""

import sys

from dnnvss.commands.entry import main

if __name__ == "__main__":
    sys.exit(main(["prepare", *sys.argv[1:]]))
