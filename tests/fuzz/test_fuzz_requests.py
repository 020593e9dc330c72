"""Damaged requests to the page of labels are answered or dropped, change no label, and the page goes on."""

import json
import random
import re
import socket
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from fuzz.damage import damaged
from fuzz.inputs import _labels
from fuzz.test_fuzz import EXAMPLES, _peak

from dnnvss.face.aam.labelling.sheet import Sheet
from dnnvss.media.pictures import write_picture
from dnnvss.studio.labelling import LabelDesk
from dnnvss.studio.server import Server, ServerLimits

ANSWERED = re.compile(rb"HTTP/1\.[01] (\d{3}) ")
BODY = json.dumps({"points": [[float(i), 2.0] for i in range(6)], "done": True}).encode()


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Server, Path]]:
    folder = tmp_path_factory.mktemp("requests") / "labels"
    _labels(folder)
    for name in ("a_0.png", "a_1.png"):
        write_picture(folder / name, np.zeros((48, 64, 3), np.uint8))
    with Server(LabelDesk(folder).page(), limits=ServerLimits(headers=0.2, sending=0.2)) as server:
        yield server, folder


def _requests(port: int) -> list[bytes]:
    """Right requests, as a browser writes them."""
    host = f"Host: 127.0.0.1:{port}\r\nConnection: close\r\n"
    read = [f"GET {path} HTTP/1.1\r\n{host}\r\n".encode()
            for path in ("/", "/labels", "/doubts", "/points/a_1.png", "/image/a_0.png")]
    kept = f"POST /points/a_0.png HTTP/1.1\r\n{host}Content-Type: application/json\r\n"
    chunked = f"{kept}Transfer-Encoding: chunked\r\n\r\n{len(BODY):x}\r\n".encode() + BODY + b"\r\n0\r\n\r\n"
    return [*read, f"{kept}Content-Length: {len(BODY)}\r\n\r\n".encode() + BODY, chunked]


def _damaged(port: int, rng: random.Random) -> bytes:
    """A request with damages anywhere, or in what it sends alone, with the length put right."""
    whole = rng.choice(_requests(port))
    if rng.random() < 0.5:
        return damaged(whole, rng)
    body = damaged(BODY, rng)
    head = _requests(port)[5].partition(b"\r\n\r\n")[0].decode()
    return re.sub(r"Length: \d+", f"Length: {len(body)}", head).encode() + b"\r\n\r\n" + body


def _sent(port: int, data: bytes) -> bytes:
    with socket.create_connection(("127.0.0.1", port), timeout=10) as client:
        try:
            client.sendall(data)
            return b"".join(iter(lambda: client.recv(65536), b""))
        except (BrokenPipeError, ConnectionResetError):
            return b""


def test_damaged_requests_are_answered_or_dropped(served: tuple[Server, Path]) -> None:
    server, folder = served
    for request, status in zip(_requests(server.port), (200, 200, 200, 200, 200, 200, 411), strict=True):
        found = ANSWERED.match(_sent(server.port, request))
        assert found and int(found[1]) == status, request
    before, files = _peak(), sorted(path.name for path in folder.iterdir())
    for number in range(5 * EXAMPLES):
        answer = _sent(server.port, _damaged(server.port, random.Random(f"request {number}")))
        found = ANSWERED.match(answer)
        assert (found and int(found[1]) < 500) or not answer, (number, answer[:300])
        assert b"Traceback" not in answer and b"root:" not in answer, number
    assert _peak() - before < 2e8
    assert ANSWERED.match(_sent(server.port, _requests(server.port)[1])).group(1) == b"200"  # type: ignore[union-attr]
    sheet = Sheet.open(folder)
    assert sorted(path.name for path in folder.iterdir()) == files
    assert all(np.isfinite(sheet.read(label)).all() for label in sheet.labels)
