"""A shortage of the system's ends a stage with its own words, is never kept, and blames no recording."""

import errno
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from conftest import ROOT

from data_prep.stages import FOLDER, Workshop
from dnnvss import files
from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.shortages import shortage_of

TRIES: list[str] = []


def short(error: BaseException) -> Callable[..., dict[str, Any]]:
    """Work whose reader is short of something the first time, and reads the second time."""

    def work(name: str, out: Path, source: Path) -> dict[str, Any]:
        TRIES.append(name)

        def reader(path: Path) -> str:
            if len(TRIES) == 1:
                raise error
            return path.read_text()

        try:
            return {"read": files.read(source, reader, "Convert it to MP4")}
        except DnnvssError as known:  # as stages do that name the utterance
            raise DnnvssError(known.problem, utterance=name, remedy=known.remedy) from known

    return work


@pytest.mark.parametrize(("error", "remedy"), [
    (MemoryError(), "fewer side by side"), (OSError(errno.EMFILE, "Too many open files"), "ulimit -n"),
    (OSError(errno.ENFILE, "File table overflow"), "ulimit -n"), (OSError(errno.ENOMEM, "no memory"), "side by side"),
    (BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable"), "ulimit -u"),
    (RuntimeError("can't start new thread"), "ulimit -u"),
    (RuntimeError("[enforce fail at alloc_cpu.cpp] . DefaultCPUAllocator: can't allocate memory"), "side by side")])
def test_a_shortage_is_no_verdict_on_a_recording(tmp_path: Path, error: BaseException, remedy: str) -> None:
    TRIES.clear()
    source = tmp_path / "a.mp4"
    source.write_text("healthy")
    shop = Workshop(tmp_path / "out", jobs=1)
    with pytest.raises(ShortageError, match=remedy) as told:
        shop.run("stage", short(error), {"a": {"source": source}})
    assert "Convert" not in str(told.value)
    assert not list((tmp_path / "out" / FOLDER).rglob("*.json"))
    assert shop.run("stage", short(error), {"a": {"source": source}}) == {"a": {"read": "healthy"}}


def test_what_is_damaged_is_no_shortage(tmp_path: Path) -> None:
    for error in (ValueError("damaged"), OSError(errno.EIO, "I/O error"), KeyError("out of memory"), EOFError()):
        assert shortage_of(error) is None
    source = tmp_path / "a.mp4"
    source.write_text("x")

    def work(name: str, out: Path) -> dict[str, Any]:
        def reader(path: Path) -> None:
            raise ValueError("damaged")
        files.read(source, reader, "Convert it")
        return {}

    assert "Convert it" in Workshop(tmp_path / "out", jobs=1).run("stage", work, {"a": {}})["a"]["dropped"]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="limits as Linux has them")
@pytest.mark.parametrize("limit", ["-n 16", "-n 32", "-v 600000", "-v 1000000", "-v 1300000", "-d 300000", "-d 500000"])
def test_a_command_under_a_limit_ends_well_or_says_which_and_succeeds_without(
        tmp_path: Path, demo: Path, limit: str) -> None:
    words = [sys.executable, "-m", "data_prep", "corpus=demo", f"corpus.out={tmp_path}/data", "corpus.sentences=8",
             "corpus.size=96", "jobs=1"]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}
    limited = subprocess.run(["bash", "-c", f'ulimit {limit}; exec "$@"', "limited", *words], capture_output=True,
                             text=True, cwd=ROOT, env=environment)
    if limited.returncode:
        assert limited.returncode == 1, limited.stderr
        last = limited.stderr.strip().splitlines()[-1]
        assert last.startswith("error: ") and ("short of" in last or "too little memory" in last), limited.stderr
    done = subprocess.run(words, capture_output=True, text=True, cwd=ROOT, env=environment)
    assert done.returncode == 0, done.stderr
    for name in ("utterances.jsonl", "report.jsonl", "corpus.json"):
        assert (tmp_path / "data" / name).read_bytes() == (demo / name).read_bytes()
