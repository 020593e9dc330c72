"""The studio as it is started from a shell: a process of its own."""

import re
import subprocess
import sys
from pathlib import Path
from typing import Any


def start_studio(runs: Path, *options: str, **piped: Any) -> tuple[subprocess.Popen[str], int]:
    """``dnnvss studio RUNS`` on a free port, and that port; it is there once this returns, its workers may not be.

    Args:
        runs: folder of run folders.
        options: of the command.
        piped: further ones of ``Popen``.
    """
    command = [sys.executable, "-m", "dnnvss", "studio", str(runs), "--port", "0", *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, **piped)
    assert process.stdout is not None
    found = re.search(r"127\.0\.0\.1:(\d+)", process.stdout.readline())
    assert found, "the studio did not start"
    return process, int(found[1])
