"""Commands under the names that they had before: what replaced them."""

import shlex
import sys
from typing import NoReturn


def moved(old: str, command: str) -> NoReturn:
    """Say what replaced ``python -m OLD`` with the same arguments, and end with status 2.

    Args:
        old: the module that was run.
        command: the command that does its work now.
    """
    print(f"error: python -m {old} is now: {shlex.join(['dnnvss', command, *sys.argv[1:]])}\n"
          f"(or python -m dnnvss {command} ... where the package is not installed)", file=sys.stderr)
    sys.exit(2)
