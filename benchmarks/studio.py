"""How the studio's service answers alone, and how it bears a crowd while its workers are killed.

``python benchmarks/studio.py RUNS [--clients 50] [--seconds 600] [--kill 20] [--workers 2]``: the
time to the first picture of a text of ten words, and from a dragged key to the picture that shows
it, alone; takes a second of one client of one worker; then so many clients at once that speak,
change, look and take away at random, for so long, while a worker chosen at random is killed every
so many seconds: answers by status, how many were lost or mixed up (each take is checked to say its
own words, each answer to hold what was asked for), takes a second, and memory of all processes
over time. The service runs in processes of its own. Strangers who mean harm are in
``tests/fuzz/test_fuzz_studio.py``.
"""

import argparse
import http.client
import json
import os
import random
import re
import signal
import statistics
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from studio_process import start_studio

TEN = "we may buy more fish before the long evening comes"
WORDS = (*TEN.split(), "papa", "moves", "five", "very", "old", "boats", "away", "from", "here")


class Service:
    """The studio in a process of its own, and its workers in theirs."""

    def __init__(self, runs: Path, workers: int) -> None:
        self.process, self.port = start_studio(runs, "--workers", str(workers))
        while json.loads(self.ask("GET", "/v1/health")[1]).get("workers", 0) < workers:
            time.sleep(0.2)

    def ask(self, method: str, path: str, body: Any = None) -> tuple[int, bytes]:
        """Status and body of an answer."""
        with closing(http.client.HTTPConnection("127.0.0.1", self.port, timeout=120)) as connection:
            data = None if body is None else json.dumps(body).encode()
            connection.request(
                method, path, data, {"Content-Type": "application/json"} if data else {}
            )
            answer = connection.getresponse()
            return answer.status, answer.read()

    @property
    def workers(self) -> list[int]:
        """Numbers of the processes that speak."""
        children = Path(f"/proc/{self.process.pid}/task").glob("*/children")
        return [int(word) for path in children for word in path.read_text().split()]

    @property
    def processor(self) -> float:
        """Seconds of the processor that its processes have taken."""
        ticks = 0
        for pid in (self.process.pid, *self.workers):
            words = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
            ticks += sum(int(word) for word in words[11:15])  # its own, and of engines that have ended
        return ticks / os.sysconf("SC_CLK_TCK")

    @property
    def memory(self) -> float:
        """Megabytes that all its processes hold now; what they share counts once."""
        held = 0
        for pid in (self.process.pid, *self.workers):
            with suppress(OSError):
                found = re.search(
                    r"^Pss:\s+(\d+)", Path(f"/proc/{pid}/smaps_rollup").read_text(), re.M
                )
                held += int(found[1]) if found else 0
        return held / 1e3


@contextmanager
def serving(runs: Path, workers: int) -> Iterator[tuple[Service, str]]:
    """A service, and the name of its first run."""
    service = Service(runs, workers)
    try:
        yield service, json.loads(service.ask("GET", "/v1/runs")[1])["runs"][0]["name"]
    finally:
        service.process.terminate()
        service.process.wait()


def first_picture(service: Service, run: str, count: int = 40) -> list[float]:
    """Seconds from the button to the first picture, sorted."""
    found = []
    for _ in range(count):
        begun = time.perf_counter()
        _, data = service.ask("POST", "/v1/speak", {"run": run, "text": TEN})
        service.ask("GET", f"/v1/takes/{json.loads(data)['id']}/pictures?first=0&count=2")
        found.append(time.perf_counter() - begun)
    return sorted(found[1:])


def dragged_key(service: Service, run: str, count: int = 60) -> list[float]:
    """Seconds from a key that was moved to the picture that shows it, sorted."""
    take = json.loads(service.ask("POST", "/v1/speak", {"run": run, "text": TEN})[1])
    name, values = "aperture", take["curves"]["aperture"]["values"]
    middle, found = len(values) // 2, []
    for k in range(count):
        goal = max(values) * (0.5 + 0.4 * k / count)
        key = {
            "time": middle / take["rate"],
            "end": (middle + 1) / take["rate"],
            "name": name,
            "low": goal,
            "high": goal,
        }
        begun = time.perf_counter()
        status, data = service.ask("POST", f"/v1/takes/{take['id']}", {"keys": [key]})
        assert status == 200, data
        take = json.loads(data)
        service.ask("GET", f"/v1/takes/{take['id']}/pictures?first={middle}&count=2")
        found.append(time.perf_counter() - begun)
    return sorted(found)


@dataclass
class Client:
    """Somebody who speaks, looks, changes and takes away until the time is over.

    Args:
        service: that is asked.
        run: that speaks.
        until: when it is over.
        rng: what it says.
        counts: answers by what was asked and their status; what was lost, mixed up or told to come again.
    """

    service: Service
    run: str
    until: float
    rng: random.Random
    counts: Counter[str] = field(default_factory=Counter)

    def ask(self, name: str, method: str, path: str, body: Any = None) -> bytes | None:
        """An answer; who is told to come again does, until the time is over."""
        while True:
            try:
                status, data = self.service.ask(method, path, body)
            except (OSError, http.client.HTTPException):
                self.counts[f"{name} lost"] += 1
                return None
            self.counts[f"{name} {status}"] += 1
            if status != 503 or time.monotonic() > self.until:
                return data if status == 200 else None
            time.sleep(1)

    def visit(self) -> None:
        """Do so."""
        while time.monotonic() < self.until:
            text = " ".join(self.rng.choices(WORDS, k=self.rng.randint(2, 7)))
            data = self.ask(
                "speak", "POST", "/v1/speak", {"run": self.run, "text": text, "engine": "formant"}
            )
            if data is None:
                continue
            take = json.loads(data)
            self.counts["mixed up"] += take["text"].lower() != text
            count = min(24, take["frames"])
            pictures = self.ask(
                "pictures", "GET", f"/v1/takes/{take['id']}/pictures?first=0&count={count}"
            )
            self.counts["mixed up"] += (
                pictures is not None and pictures.count(b"\xff\xd8\xff") != count
            )
            changed = self.ask(
                "change",
                "POST",
                f"/v1/takes/{take['id']}",
                {"articulation": self.rng.uniform(0.5, 1.5)},
            )
            self.counts["mixed up"] += (
                changed is not None and json.loads(changed)["text"].lower() != text
            )
            curves = self.ask("curves", "GET", f"/v1/takes/{take['id']}/files/curves.csv")
            self.counts["mixed up"] += (
                curves is not None and curves.count(b"\n") != take["frames"] + 1
            )


def crowd(
    service: Service, run: str, clients: int, seconds: float, kill: float
) -> tuple[Counter[str], list[float], int]:
    """Answers by status, megabytes every second, and how many workers were killed."""
    until, rng, memory, killed = time.monotonic() + seconds, random.Random(0), list[float](), 0
    people = [Client(service, run, until, random.Random(k)) for k in range(clients)]
    threads = [threading.Thread(target=each.visit) for each in people]
    for thread in threads:
        thread.start()
    begun = time.monotonic()
    while time.monotonic() < until:
        time.sleep(1)
        memory.append(service.memory)
        if kill and (time.monotonic() - begun) // kill > killed and (workers := service.workers):
            os.kill(rng.choice(workers), signal.SIGKILL)
            killed += 1
    for thread in threads:
        thread.join()
    return sum((each.counts for each in people), Counter()), memory, killed


def middle(values: list[float], first: float, last: float) -> float:
    """The median of a part of values; the part as shares of the whole."""
    return statistics.median(values[int(first * len(values)) : max(int(last * len(values)), 1)])


def told(service: Service, run: str, measured: Callable[[Service, str], list[float]]) -> str:
    """The middle and the 95th of 100 of sorted seconds, and how long the processor worked for each."""
    before = service.processor
    seconds = measured(service, run)
    each = (service.processor - before) / len(seconds)
    return (
        f"median {statistics.median(seconds):.3f} s, 95 % {seconds[int(0.95 * len(seconds))]:.3f} s, "
        f"of the processor {each:.3f} s"
    )


def main() -> None:
    """Print what was seen."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("runs", type=Path)
    parser.add_argument("--clients", type=int, default=50)
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument(
        "--kill",
        type=float,
        default=20,
        help="seconds between two workers that are killed; 0: none is",
    )
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    alone = min(30.0, options.seconds)
    with serving(options.runs, 1) as (service, run):
        print(f"first picture of ten words: {told(service, run, first_picture)}", flush=True)
        print(f"from a dragged key to its picture: {told(service, run, dragged_key)}", flush=True)
        one, *_ = crowd(service, run, 1, alone, 0)
    rate = one["speak 200"] / alone
    print(
        f"one client of one worker: {rate:.2f} takes a second; load of the machine {os.getloadavg()[0]:.1f}",
        flush=True,
    )
    with serving(options.runs, options.workers) as (service, run):
        counts, memory, killed = crowd(service, run, options.clients, options.seconds, options.kill)
        print(
            f"{options.clients} clients of {options.workers} workers, {options.seconds:g} s, {killed} workers killed; "
            f"load of the machine {os.getloadavg()[0]:.1f}: {dict(sorted(counts.items()))}"
        )
        pace = counts["speak 200"] / options.seconds
        print(f"takes a second: {pace:.2f}, {pace / rate:.2f} times one client of one worker")
        print(
            "memory, in tenths of the time: "
            + " ".join(f"{middle(memory, k / 10, (k + 1) / 10):.0f}" for k in range(10))
            + f" MB; last against second {middle(memory, 0.9, 1) / middle(memory, 0.1, 0.2):.3f}"
        )
        status, health = service.ask("GET", "/v1/health")
        print(f"still well: {status == 200}, {health.decode()}")


if __name__ == "__main__":
    main()
