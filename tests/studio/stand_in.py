"""A worker for tests of the pool: it does what a job says, and knows nothing of faces."""

import os
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dnnvss.studio.wire import framed, read_frame

COMMAND = (sys.executable, __file__)


def answer(job: Mapping[str, Any]) -> bytes:
    """The message that answers a job: ``sleep`` seconds first, or its end where ``once`` is no file yet.

    Where ``starts`` names a file, another process is started and its number is written there.
    """
    if "starts" in job:  # as a voice is started that speaks for long
        child = subprocess.Popen(["sleep", "60"], stdout=subprocess.DEVNULL)
        Path(job["starts"]).write_text(str(child.pid), encoding="utf-8")
    time.sleep(job.get("sleep", 0))
    if "die" in job:
        os._exit(3)
    if "once" in job and not Path(job["once"]).exists():
        Path(job["once"]).touch()
        os._exit(3)
    if "wrong" in job:
        return framed(
            {
                "wrong": {
                    "problem": job["wrong"],
                    "file": None,
                    "utterance": None,
                    "remedy": "Mend it",
                }
            }
        )
    if "fail" in job:
        return framed({"failed": "RuntimeError"})
    return framed(
        {"said": job.get("say"), "kind": "application/json", "frames": 1}, str(os.getpid()).encode()
    )


def main() -> None:
    """Answer until there is nothing more."""
    out = sys.stdout.buffer
    greeting = read_frame(sys.stdin.buffer)
    if greeting is None or greeting[0].get("broken"):
        sys.exit(1)
    frame = framed({"ready": True})
    while True:
        out.write(frame)
        out.flush()
        if (given := read_frame(sys.stdin.buffer)) is None:
            return
        frame = answer(given[0])


if __name__ == "__main__":
    main()
