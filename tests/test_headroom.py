"""A limit below what the libraries take is told before one of them ends the process without a word."""

import os
import resource
import subprocess
import sys

import pytest
from conftest import ROOT

from dnnvss import headroom
from dnnvss.errors import ShortageError

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits as Linux has them")


def limited(monkeypatch: pytest.MonkeyPatch, kind: str, megabytes: float) -> None:
    bound = resource.RLIM_INFINITY if megabytes == float("inf") else int(megabytes * 2**20)
    monkeypatch.setattr(resource, "getrlimit",
                        lambda asked: (bound if asked == getattr(resource, kind) else resource.RLIM_INFINITY,) * 2)


@pytest.mark.parametrize("limit", headroom.LIMITS, ids=lambda limit: limit.name)
def test_a_limit_is_told_with_what_is_allowed_and_what_is_needed(monkeypatch: pytest.MonkeyPatch,
                                                                 limit: headroom.Limit) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    needed = limit.base + limit.thread
    limited(monkeypatch, limit.name, needed - 1)
    with pytest.raises(ShortageError, match=rf"{needed - 1} MB \(ulimit -{limit.flag}\).* {needed} MB"):
        headroom.for_libraries()
    limited(monkeypatch, limit.name, needed)
    headroom.for_libraries()


def test_products_need_room_beside_what_is_held(monkeypatch: pytest.MonkeyPatch) -> None:
    held = headroom._held("VmData")
    assert held > 10
    limited(monkeypatch, "RLIMIT_DATA", held + 1)
    with pytest.raises(ShortageError, match="ulimit -d"):
        headroom.for_products()
    limited(monkeypatch, "RLIMIT_DATA", held + 1000)
    headroom.for_products()


def test_without_a_limit_nothing_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    limited(monkeypatch, "RLIMIT_AS", float("inf"))
    monkeypatch.setattr(headroom, "_held", lambda row: pytest.fail("asked"))
    headroom.for_libraries()
    headroom.for_products()


@pytest.mark.parametrize(("asked", "threads"), [("1", 1), ("100000", None), ("many", None), ("0", 1), ("", None)])
def test_threads_are_what_is_asked_for_and_at_most_the_cores(monkeypatch: pytest.MonkeyPatch, asked: str,
                                                             threads: int | None) -> None:
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    monkeypatch.setenv("OMP_NUM_THREADS", asked)
    assert headroom._threads() == (threads or len(os.sched_getaffinity(0)))


@pytest.mark.parametrize("limit", ["-v 900000", "-d 300000"])  # torch's abort, and OpenBLAS that waits for ever
def test_a_command_says_which_limit_is_too_low(limit: str) -> None:
    words = [sys.executable, "-m", "dnnvss", "speak", "text=hello"]
    done = subprocess.run(["bash", "-c", f'ulimit {limit}; exec "$@"', "limited", *words], capture_output=True,
                          text=True, cwd=ROOT, timeout=60)
    assert done.returncode == 1
    assert done.stderr.startswith("error: the system is short of") and len(done.stderr.splitlines()) == 1
