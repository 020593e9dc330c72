"""How the studio's service bears a crowd, and strangers.

``python benchmarks/studio.py RUNS [--clients 50] [--seconds 600] [--hostile 10000]``: the time to
the first picture of a text of ten words, alone; then so many clients at once that speak, change,
look and take away at random, for so long: answers by status, none mixed up (each take is checked to
say its own words), takes a second against one client alone, and memory of the service from the
first tenth of the time to the end; then so many damaged requests, after which the service still
answers. The service runs in a process of its own.
"""

import argparse
import http.client
import json
import random
import re
import resource
import socket
import statistics
import subprocess
import sys
import threading
import time
from collections import Counter
from contextlib import closing
from pathlib import Path
from typing import Any

TEN = "we may buy more fish before the long evening comes"
WORDS = (*TEN.split(), "papa", "moves", "five", "very", "old", "boats", "away", "from", "here")
_DAMAGE = (b"\0", b"\xff", b"../", b"9" * 30, b"{", b"[" * 40, b"NaN", b"")


class Service:
    """The studio in a process of its own."""

    def __init__(self, runs: Path) -> None:
        command = [sys.executable, "-m", "dnnvss", "studio", str(runs), "--port", "0"]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        found = re.search(r"127\.0\.0\.1:(\d+)", self.process.stdout.readline())
        assert found, "the studio did not start"
        self.port = int(found[1])

    def ask(self, method: str, path: str, body: Any = None) -> tuple[int, bytes]:
        """Status and body of an answer."""
        with closing(http.client.HTTPConnection("127.0.0.1", self.port, timeout=120)) as connection:
            data = None if body is None else json.dumps(body).encode()
            connection.request(method, path, data, {"Content-Type": "application/json"} if data else {})
            answer = connection.getresponse()
            return answer.status, answer.read()

    @property
    def memory(self) -> float:
        """Megabytes that it holds now."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        found = re.search(r"VmRSS:\s+(\d+)", status)
        return int(found[1]) / 1e3 if found else float("nan")


def first_picture(service: Service, run: str, count: int = 20) -> list[float]:
    """Seconds from the button to the first picture, sorted."""
    found = []
    for _ in range(count):
        begun = time.perf_counter()
        _, data = service.ask("POST", "/v1/speak", {"run": run, "text": TEN})
        service.ask("GET", f"/v1/takes/{json.loads(data)['id']}/pictures?first=0&count=2")
        found.append(time.perf_counter() - begun)
    return sorted(found[1:])


def visit(service: Service, run: str, until: float, rng: random.Random, counts: Counter[str]) -> None:
    """What one client does: it speaks, looks, changes and takes away until the time is over."""
    while time.monotonic() < until:
        text = " ".join(rng.choices(WORDS, k=rng.randint(2, 7)))
        status, data = service.ask("POST", "/v1/speak", {"run": run, "text": text, "engine": "formant"})
        counts[f"speak {status}"] += 1
        if status != 200:
            time.sleep(1)
            continue
        take = json.loads(data)
        counts["mixed up"] += take["text"].lower() != text
        asked = [("GET", f"/v1/takes/{take['id']}/pictures?first=0&count=24", None),
                 ("POST", f"/v1/takes/{take['id']}", {"articulation": rng.uniform(0.5, 1.5)}),
                 ("GET", f"/v1/takes/{take['id']}/files/curves.csv", None)]
        for method, path, body in asked:
            status, data = service.ask(method, path, body)
            counts[f"{path.split('/')[-1].split('?')[0] if method == 'GET' else 'change'} {status}"] += 1
            if method == "POST" and status == 200:
                counts["mixed up"] += json.loads(data)["text"].lower() != text


def crowd(service: Service, run: str, clients: int, seconds: float) -> tuple[Counter[str], float, float]:
    """Answers by status, and megabytes after a tenth of the time and at the end."""
    counts: Counter[str] = Counter()
    until = time.monotonic() + seconds
    threads = [threading.Thread(target=visit, args=(service, run, until, random.Random(k), counts))
               for k in range(clients)]
    for thread in threads:
        thread.start()
    time.sleep(seconds / 10)
    early = service.memory
    for thread in threads:
        thread.join()
    return counts, early, service.memory


def hostile(service: Service, run: str, count: int) -> Counter[str]:
    """Damaged requests by what came back."""
    counts: Counter[str] = Counter()
    body = json.dumps({"run": run, "text": "a b", "keys": [{"time": 0.1, "name": "aperture", "low": 1}]})
    heads = [f"GET {p} HTTP/1.1\r\nHost: 127.0.0.1:{service.port}\r\nConnection: close\r\n\r\n" for p in (
        "/", "/page.js", "/v1/runs", "/v1/takes/abc", "/v1/takes/abc/pictures?first=0&count=2", "/v1/openapi.json",
        "/v1/takes/..%2f..%2fetc/files/passwd", "/..%2f..%2fetc%2fpasswd", "/v1/stream", "/v1/metrics")]
    heads += [f"POST {p} HTTP/1.1\r\nHost: 127.0.0.1:{service.port}\r\nConnection: close\r\nContent-Type: "
              f"application/json\r\nContent-Length: {len(body)}\r\n\r\n{body}" for p in ("/v1/speak", "/v1/takes/abc")]
    for number in range(count):
        rng = random.Random(number)
        data = bytearray(rng.choice(heads).encode())
        for _ in range(rng.randint(1, 6)):
            at = rng.randrange(len(data))
            data[at:at + rng.randint(0, 3)] = rng.choice(_DAMAGE)
        answer = sent(service.port, bytes(data))
        found = re.match(rb"HTTP/1\.[01] (\d{3}) ", answer)
        counts[found[1].decode() if found else "dropped"] += 1
        counts["told too much"] += b"Traceback" in answer or b"root:" in answer
    return counts


def sent(port: int, data: bytes) -> bytes:
    """What comes back of bytes; one who gets nothing leaves after half a second."""
    got = b""
    with socket.create_connection(("127.0.0.1", port), timeout=0.5) as client:
        try:
            client.sendall(data)
            while part := client.recv(65536):
                got += part
        except (TimeoutError, ConnectionError):
            pass
    return got


def main() -> None:
    """Print what was seen."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", type=Path)
    parser.add_argument("--clients", type=int, default=50)
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--hostile", type=int, default=10_000)
    options = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_NOFILE, (4096, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))
    service = Service(options.runs)
    try:
        run = json.loads(service.ask("GET", "/v1/runs")[1])["runs"][0]["name"]
        alone = first_picture(service, run)
        print(f"first picture of ten words: median {statistics.median(alone):.2f} s, "
              f"95 % {alone[int(0.95 * len(alone))]:.2f} s")
        one, *_ = crowd(service, run, 1, min(20.0, options.seconds))
        rate = one["speak 200"] / min(20.0, options.seconds)
        counts, early, late = crowd(service, run, options.clients, options.seconds)
        print(f"{options.clients} clients, {options.seconds:g} s: {dict(sorted(counts.items()))}")
        pace = counts["speak 200"] / options.seconds
        print(f"takes a second: {pace:.2f}, {pace / rate:.2f} times one client alone; "
              f"memory {early:.0f} MB early, {late:.0f} MB at the end")
        print(f"damaged requests: {dict(sorted(hostile(service, run, options.hostile).items()))}")
        print(f"still well: {service.ask('GET', '/v1/health')[0] == 200}, {service.memory:.0f} MB")
    finally:
        service.process.terminate()
        service.process.wait()


if __name__ == "__main__":
    main()
