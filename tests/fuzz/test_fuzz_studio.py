"""Strangers at the studio: none gets a file outside, a traceback, or stops the service for others.

``DNNVSS_FUZZ=400`` tries 10,000 against real workers that speak, in the slow suite; the fast one tries some against
stand-ins.
"""

import os
import re
import subprocess
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pytest
from conftest import run_command
from fuzz.strangers import KINDS, Target, harmless, kind_of, tried
from studio.stand_in import COMMAND
from studio_process import start_studio

from dnnvss.studio.pool import PoolLimits
from dnnvss.studio.server import Server, ServerLimits
from dnnvss.studio.speaking import SpeakingDesk

COUNT = 25 * int(os.environ.get("DNNVSS_FUZZ", "2"))
"""Requests of strangers."""


def visited(to: Target, count: int, strangers: int, report: Path) -> Counter[tuple[str, str]]:
    """Statuses by kind, while somebody else is answered rightly all the time.

    Args:
        to: the service.
        count: requests.
        strangers: how many are made at once.
        report: a file that says how far it is.
    """
    stop, right, waits = (
        threading.Event(),
        to.sent(to.get(f"/v1/takes/{to.take}/sound")),
        list[float](),
    )
    assert harmless(right) == "200"

    def bystander() -> None:
        while not stop.wait(0.1):
            begun = time.monotonic()
            while (again := to.sent(to.get(f"/v1/takes/{to.take}/sound"), wait=60)).startswith(
                b"HTTP/1.1 503"
            ):
                time.sleep(1)
            waits.append(time.monotonic() - begun)
            assert again.partition(b"\r\n\r\n")[2] == right.partition(b"\r\n\r\n")[2], again[:200]

    counts = Counter[tuple[str, str]]()
    with ThreadPoolExecutor(strangers + 1) as people:
        other = people.submit(bystander)
        try:
            for number, found in enumerate(people.map(lambda k: tried(to, k), range(count))):
                counts[found] += 1
                if number % 100 == 99:
                    report.write_text(
                        f"{number + 1} {dict(sorted(counts.items()))} {max(waits):.2f}"
                    )
        finally:
            stop.set()
        other.result()
    report.write_text(
        f"{count} {dict(sorted(counts.items()))}; others waited {max(waits):.2f} s at most, "
        f"{sorted(waits)[len(waits) // 2]:.3f} s in the middle"
    )
    return counts


def everything(folder: Path) -> dict[str, tuple[int, int]]:
    """Every file under a folder with its size and the time of its last change."""
    return {
        str(path.relative_to(folder)): (path.stat().st_size, path.stat().st_mtime_ns)
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_every_kind_comes_as_often_as_it_says() -> None:
    assert sum(share for _, share in KINDS.values()) == 100
    assert Counter(kind_of(k) for k in range(100)) == {
        name: share for name, (_, share) in KINDS.items()
    }


@pytest.fixture
def house(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder in which all temporary files lie, and nothing else is written."""
    (tmp_path / "tmp").mkdir()
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setenv("TMPDIR", str(tmp_path / "tmp"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    yield tmp_path
    assert not any((tmp_path / "tmp").iterdir()), "something is left behind"
    assert not any((tmp_path / "here").iterdir()), (
        "something was written where the service was started"
    )


@contextmanager
def stood_in(runs: Path) -> Iterator[Target]:
    desk = SpeakingDesk(runs, {}, PoolLimits(workers=2), worker=COMMAND)
    with Server(desk.page(), limits=ServerLimits(headers=0.4, sending=0.4)) as server:
        start = Target(server.port, "run", "none")
        assert harmless(start.sent(start.post("/v1/speak", start.saying()))) == "200"
        yield Target(server.port, "run", desk._known._takes.items()[0][0])
    desk.close()


def test_strangers_harm_nobody(house: Path) -> None:
    runs = house / "runs"
    runs.mkdir()
    with stood_in(runs) as to:
        counts = visited(to, min(COUNT, 50), 12, house / "report")
        assert harmless(to.sent(to.post("/v1/speak", to.saying()))) == "200"
    assert sum(counts.values()) == min(COUNT, 50) and not any(runs.iterdir())


@pytest.mark.slow
def test_strangers_harm_nobody_who_is_spoken_to(demo: Path, house: Path) -> None:
    """The same against the command, with a run that speaks."""
    runs = house / "runs"
    assert (
        run_command(
            "train",
            "corpus=demo",
            f"corpus.out={demo}",
            "model=phone_mean",
            "sample=false",
            f"runs={runs}",
        )
        == 0
    )
    for left in (house / "here").iterdir():
        left.unlink()
    before = everything(runs)
    service, port = start_studio(runs, "--log", str(house / "log"), stderr=subprocess.PIPE)
    with service:
        try:
            assert service.stderr is not None
            to = Target(port, next(runs.iterdir()).name, "none")
            until = time.monotonic() + 120
            while harmless(to.sent(to.get("/v1/health"))) != "200":
                assert time.monotonic() < until, "no worker came"
                time.sleep(0.5)
            said = re.search(
                rb'"id": "([\w-]+)"', to.sent(to.post("/v1/speak", to.saying()), wait=120)
            )
            assert said
            counts = visited(Target(to.port, to.run, said[1].decode()), COUNT, 12, house / "report")
            print((house / "report").read_text())
            assert harmless(to.sent(to.post("/v1/speak", to.saying()), wait=60)) == "200"
            assert counts["damaged bodies", "200"] and counts["damaged bodies", "400"]
        finally:
            service.terminate()
            said_more = service.stderr.read()
            assert service.wait() == 0
    assert "Traceback" not in said_more, said_more[-3000:]
    assert everything(runs) == before
    assert "<script>" not in (house / "log").read_text()
