"""The built-in talker, made where there is no run yet: its corpus and a run of it, by commands that anybody types."""

import os
import subprocess
import sys
import threading
from collections import deque
from pathlib import Path
from typing import Any

STEPS = ((["prepare", "corpus=demo"], "making the built-in talker's corpus"),
         (["train", "corpus=demo"], "training a system on it"))
"""Arguments of each command, and what it does."""
_LINES = 200


class Setup:
    """A first run in the making.

    Args:
        runs: the folder that it will lie in.
    """

    def __init__(self, runs: Path) -> None:
        self._runs, self._lines, self._lock = runs, deque[str](maxlen=_LINES), threading.Lock()
        self._thread: threading.Thread | None = None
        self._process: subprocess.Popen[str] | None = None
        self._step, self._failed, self._ended = "", False, False

    def start(self) -> dict[str, Any]:
        """Begin, unless it has begun."""
        with self._lock:
            if (self._thread is None or not self._thread.is_alive()) and not self._ended:
                self._failed, self._thread = False, threading.Thread(target=self._work, daemon=True)
                self._thread.start()
        return self.state()

    def state(self) -> dict[str, Any]:
        """How far it is: ``running``, ``failed``, the step and the last lines."""
        running = self._thread is not None and self._thread.is_alive()
        return {"running": running, "failed": self._failed, "step": self._step, "lines": list(self._lines)[-12:]}

    def end(self) -> None:
        """End the command at work; what it has made is taken up by the next one."""
        self._ended = True
        if self._process is not None and self._process.poll() is None:
            self._process.terminate()
            self._process.wait()

    def _work(self) -> None:
        for arguments, about in STEPS:
            self._step = about
            if self._ended or self._run(arguments):
                self._failed = True
                return
        self._step = ""

    def _run(self, arguments: list[str]) -> int:
        more = [f"runs={self._runs}"] if arguments[0] == "train" else []
        command = [sys.executable, "-m", "dnnvss", *arguments, *more]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                         stdin=subprocess.DEVNULL, errors="replace", env={**os.environ})
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._lines.append(line.rstrip()[:300])
        return self._process.wait()
