"""``python -m dnnvss COMMAND ...``: the commands of the package; ``--help`` lists them."""

import sys

from dnnvss.commands.entry import main

if __name__ == "__main__":
    sys.exit(main())
