"""What strangers send to the studio: damaged, oversized, slow, cut, from elsewhere, with names that lead out.

Each kind of :data:`KINDS` does one thing to a server and returns what came back, for :func:`harmless`.
"""

import base64
import io
import json
import os
import random
import re
import socket
import struct
import time
import wave
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from urllib.parse import quote

from fuzz.damage import damaged

ANSWER = re.compile(rb"HTTP/\d\.\d (\d{3}) ")
SCRIPT = "<script>alert(1)</script><img src=x onerror=alert(1)>\r\nSet-Cookie: a=b"
"""A text that would run where it is shown as a page, and a header where it is copied into a head."""
NAMES = (
    "../../../etc/passwd",
    "..%2f..%2f..%2fetc%2fpasswd",
    "%2e%2e/%2e%2e/etc/passwd",
    "/etc/passwd",
    "..\\..\\a",
    "....//....//etc/passwd",
    "a%00.TextGrid",
    "%252e%252e%252fetc%252fpasswd",
    "CON",
    "~root/.bashrc",
    "a" * 5000,
    quote(SCRIPT),
    quote("\u202egnp.TextGrid"),
    "..",
    ".",
    "%c0%ae%c0%ae/etc/passwd",
    "file:///etc/passwd",
    "..;/..;/etc/passwd",
    "speech.mp4/../../../model.npz",
)
"""Names that would lead out of a folder, or are none."""


@dataclass(frozen=True)
class Target:
    """A service, and what is known of it.

    Args:
        port: of this machine.
        run: a run.
        take: a take.
    """

    port: int
    run: str
    take: str

    def head(self, line: str, *headers: str, host: str | None = None, close: bool = True) -> bytes:
        """The head of a request."""
        own = [
            line,
            f"Host: {host or f'127.0.0.1:{self.port}'}",
            *(["Connection: close"] if close else []),
            *headers,
        ]
        return ("\r\n".join(own) + "\r\n\r\n").encode("utf-8", "surrogateescape")

    def get(self, path: str, *headers: str, **more: Any) -> bytes:
        """A request for a path."""
        return self.head(f"GET {path} HTTP/1.1", *headers, **more)

    def post(
        self, path: str, body: bytes, kind: str = "application/json", *headers: str, **more: Any
    ) -> bytes:
        """A request that brings something."""
        own = (f"Content-Type: {kind}", f"Content-Length: {len(body)}", *headers)
        return self.head(f"POST {path} HTTP/1.1", *own, **more) + body

    def saying(self, **more: Any) -> bytes:
        """The body of a right request."""
        key = {"time": 0.1, "name": "aperture", "low": 1.0, "high": 2.0, "end": 0.2}
        return json.dumps(
            {"run": self.run, "text": "papa", "engine": "formant", "keys": [key], **more}
        ).encode()

    def rights(self) -> list[bytes]:
        """Right requests."""
        gets = (
            "/",
            "/page.js",
            "/v1/runs",
            f"/v1/takes/{self.take}",
            "/v1/health",
            "/v1/metrics",
            "/v1/openapi.json",
            f"/v1/takes/{self.take}/pictures?first=0&count=2",
            f"/v1/takes/{self.take}/files/curves.csv",
        )
        return [
            *(self.get(path) for path in gets),
            self.post("/v1/speak", self.saying()),
            self.post(f"/v1/takes/{self.take}", b'{"articulation": 1.2}'),
            self.upgrade(),
        ]

    def upgrade(self, *headers: str, **more: Any) -> bytes:
        """The request for a WebSocket."""
        return self.get(
            "/v1/stream",
            "Upgrade: websocket",
            "Connection: Upgrade",
            "Sec-WebSocket-Version: 13",
            "Sec-WebSocket-Key: " + base64.b64encode(os.urandom(16)).decode(),
            *headers,
            close=False,
            **more,
        )

    def sent(
        self, *parts: bytes, wait: float = 30.0, between: float = 0.0, stay: bool = True
    ) -> bytes:
        """What comes back of bytes; nothing where one does not stay for it."""
        got = b""
        with socket.create_connection(("127.0.0.1", self.port), timeout=wait) as client:
            try:
                for part in parts:
                    client.sendall(part)
                    if between:
                        time.sleep(between)
                while stay and (part := client.recv(65536)):
                    got += part
            except (TimeoutError, ConnectionError):
                pass
        return got


def harmless(answer: bytes, text: bytes = b"") -> str:
    """The status of an answer, ``none`` where there is none; it tells nothing, and runs nothing.

    Args:
        answer: what came back.
        text: what may not come back as a page.
    """
    for word in (b"Traceback", b"root:x:", b'File "', b"site-packages"):
        assert word not in answer, answer[:500]
    if not answer:
        return "none"
    found = ANSWER.match(answer)
    assert found, answer[:200]
    status, head = int(found[1]), answer.partition(b"\r\n\r\n")[0].lower()
    assert status < 500 or status == 503, answer[:500]
    assert b"set-cookie" not in head and (status == 101 or b"nosniff" in head or status == 503), (
        answer[:500]
    )
    if text and text in answer:
        assert b"content-type: application/json" in head, answer[:500]
    return str(status)


def _damaged(to: Target, rng: random.Random) -> bytes:
    return to.sent(damaged(rng.choice(to.rights()), rng), wait=3.0)


def _bodies(to: Target, rng: random.Random) -> bytes:
    path = rng.choice(("/v1/speak", f"/v1/takes/{to.take}"))
    return to.sent(
        to.post(
            path,
            damaged(to.saying() if path == "/v1/speak" else b'{"keys": [], "rest": null}', rng),
        )
    )


def _scripts(to: Target, rng: random.Random) -> bytes:
    name = rng.choice(("text", "run", "style", "engine", "view", "sound", "rate"))
    words = {"pronunciations": {SCRIPT: "P AA1"}} if rng.random() < 0.2 else {name: SCRIPT}
    return to.sent(to.post("/v1/speak", to.saying(**words)))


def _names(to: Target, rng: random.Random) -> bytes:
    name = rng.choice(NAMES)
    asked = (
        to.get(f"/{name}"),
        to.get(f"/v1/takes/{name}"),
        to.get(f"/v1/takes/{to.take}/files/{name}"),
        to.get(f"/v1/takes/{name}/files/speech.mp4"),
        to.get(f"/labelling/{name}"),
        to.post(f"/v1/alignments/{name}", b"x", "application/octet-stream"),
        to.get(f"/v1/takes/{to.take}/pictures?view={name}"),
        to.post(f"/v1/takes/{name}", b"{}"),
        to.post("/v1/speak", to.saying(run=name)),
        to.post("/v1/speak", to.saying(sound=name)),
    )
    return to.sent(rng.choice(asked))


def _elsewhere(to: Target, rng: random.Random) -> bytes:
    host = rng.choice(
        (
            "evil.example",
            f"evil.example:{to.port}",
            f"127.0.0.1.evil.example:{to.port}",
            "localhost:1",
            f"127.0.0.1:{to.port}@evil.example",
            "",
            f"[::1]:{to.port}",
        )
    )
    header = rng.choice(
        (
            "Origin: https://evil.example",
            "Origin: null",
            "Sec-Fetch-Site: cross-site",
            f"Origin: http://127.0.0.1:{to.port + 1}",
            f"Origin: http://127.0.0.1.evil:{to.port}",
        )
    )
    wrong = rng.choice(
        (
            to.get("/v1/runs", host=host or " "),
            to.post("/v1/speak", to.saying(), host=host or " "),
            to.post("/v1/speak", to.saying(), "application/json", header),
            to.upgrade(header),
            to.upgrade(host="evil"),
            to.post("/v1/setup", b"{}", "application/json", header),
            to.post("/v1/speak", to.saying(), "text/plain"),
            to.get("/v1/runs", f"Host: 127.0.0.1:{to.port}"),
            to.get("http://evil.example/v1/runs", host="evil.example"),
        )
    )
    answer = to.sent(wrong)
    assert harmless(answer) in ("400", "403", "404", "415"), answer[:200]
    return answer


def _large(to: Target, rng: random.Random) -> bytes:
    path, kind, most = rng.choice(
        (
            ("/v1/speak", "application/json", 10**6),
            ("/v1/sounds", "application/octet-stream", 6 * 10**7),
            ("/v1/alignments/a.lab", "application/octet-stream", 5 * 10**6),
        )
    )
    length = most + rng.choice((1, 10**6, 10**12))
    line = f"POST {path} HTTP/1.1"
    answer = to.sent(
        to.head(line, f"Content-Type: {kind}", f"Content-Length: {length}") + b"a" * 1000
    )
    assert harmless(answer) in ("413", "400"), answer[:200]
    return answer


def _cut(to: Target, rng: random.Random) -> bytes:
    whole = rng.choice([*to.rights(), to.post("/v1/sounds", sound(), "application/octet-stream")])
    return to.sent(whole[: rng.randrange(1, len(whole))], stay=False)


def _gone(to: Target, rng: random.Random) -> bytes:
    return to.sent(rng.choice(to.rights()), stay=False)


def _slow(to: Target, rng: random.Random) -> bytes:
    whole = rng.choice(to.rights())
    edges = sorted(rng.randrange(len(whole)) for _ in range(rng.randint(2, 6)))
    parts = [whole[a:b] for a, b in zip([0, *edges], [*edges, len(whole)], strict=True)]
    return to.sent(*parts, between=0.15, stay=rng.random() < 0.7, wait=3.0)


def _frames(to: Target, rng: random.Random) -> bytes:
    """A WebSocket with frames that are damaged, too large, unmasked, or no JSON."""
    text = rng.choice((to.saying(), damaged(to.saying(), rng), b"\xff\xfe", b"[" * 5000, b""))
    frame = _frame(text, rng.choice((1, 1, 1, 2, 0, 3, 8, 9, 15)), rng.random() < 0.9)
    if rng.random() < 0.2:
        frame = b"\x81\xff" + struct.pack(">Q", rng.choice((10**7, 2**63 + 5))) + b"abcd" + text
    if rng.random() < 0.3:
        frame = damaged(frame, rng) if frame else frame
    return to.sent(
        to.upgrade(), frame, between=0.02, wait=rng.choice((0.2, 1.0)), stay=rng.random() < 0.7
    )


def _frame(text: bytes, kind: int, masked: bool) -> bytes:
    length = (
        bytes([len(text)])
        if len(text) < 126
        else b"\x7e" + struct.pack(">H", min(len(text), 65535))
    )
    if not masked:
        return bytes([0x80 | kind]) + length + text
    return bytes([0x80 | kind, length[0] | 0x80]) + length[1:] + b"\0\0\0\0" + text


def sound() -> bytes:
    """A tenth of a second as WAV."""
    file = io.BytesIO()
    with wave.open(file, "wb") as out:
        out.setnchannels(1)
        out.setsampwidth(2)
        out.setframerate(16000)
        out.writeframes(random.Random(0).randbytes(3200))
    return file.getvalue()


TEXTGRID = (
    b'File type = "ooTextFile"\nObject class = "TextGrid"\n\nxmin = 0\nxmax = 0.3\ntiers? <exists>\nsize = 1\n'
    b'item []:\n    item [1]:\n        class = "IntervalTier"\n        name = "phones"\n        xmin = 0\n'
    b"        xmax = 0.3\n        intervals: size = 2\n        intervals [1]:\n            xmin = 0\n"
    b'            xmax = 0.1\n            text = "P"\n        intervals [2]:\n            xmin = 0.1\n'
    b'            xmax = 0.3\n            text = "AA1"\n'
)


def _brought(to: Target, rng: random.Random) -> bytes:
    if rng.random() < 0.5:
        return to.sent(to.post("/v1/sounds", damaged(sound(), rng), "application/octet-stream"))
    name = rng.choice(("a.TextGrid", "a.lab", "a.align", quote(SCRIPT) + ".TextGrid"))
    return to.sent(
        to.post(f"/v1/alignments/{name}", damaged(TEXTGRID, rng), "application/octet-stream")
    )


def _bombs(to: Target, rng: random.Random) -> bytes:
    """What opens to much, or names other files and addresses."""
    bombs = (
        b"#EXTM3U\n#EXTINF:1,\n/etc/passwd\n",
        b"ffconcat version 1.0\nfile /etc/passwd\n",
        b"v=0\no=- 0 0 IN IP4 127.0.0.1\nc=IN IP4 127.0.0.1\nm=audio 1 RTP/AVP 0\n",
        _claiming(0xFFFFFFF0),
        _claiming(0x7FFFFFFF),
        b"PK\x03\x04" + rng.randbytes(200),
        _silence(4 * 3600),
        b'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><MPD>&b;</MPD>',
    )
    return to.sent(to.post("/v1/sounds", rng.choice(bombs), "application/octet-stream"), wait=90.0)


def _claiming(length: int) -> bytes:
    """A WAV that says it is so long."""
    data = bytearray(sound())
    data[4:8], data[40:44] = struct.pack("<I", length), struct.pack("<I", length)
    return bytes(data)


def _silence(seconds: int, kept: dict[int, bytes] = {}) -> bytes:  # noqa: B006
    """So much silence as FLAC, which is small."""
    if seconds not in kept:
        import av
        import numpy as np

        file = io.BytesIO()
        with av.open(file, "w", format="flac") as out:
            stream = out.add_stream("flac", rate=8000, layout="mono")
            frame = av.AudioFrame.from_ndarray(
                np.zeros((1, 8000 * 60), np.int16), format="s16", layout="mono"
            )
            frame.sample_rate = 8000
            for minute in range(seconds // 60):
                frame.pts = minute * 8000 * 60
                out.mux(stream.encode(frame))
            out.mux(stream.encode(None))
        kept[seconds] = file.getvalue()
    return kept[seconds]


Kind = Callable[[Target, random.Random], bytes]
KINDS: dict[str, tuple[Kind, int]] = {
    "damaged requests": (_damaged, 20),
    "damaged bodies": (_bodies, 20),
    "scripts": (_scripts, 5),
    "names that lead out": (_names, 15),
    "wrong host or origin": (_elsewhere, 10),
    "oversized": (_large, 5),
    "cut": (_cut, 6),
    "gone": (_gone, 4),
    "slow": (_slow, 5),
    "damaged frames": (_frames, 6),
    "damaged files": (_brought, 3),
    "bombs": (_bombs, 1),
}
"""Kinds by name, and how many of a hundred are of each."""


def kind_of(number: int) -> str:
    """The kind of a request by its number: of a hundred in a row, as many as :data:`KINDS` says, well mixed."""
    row = [name for name, (_, share) in KINDS.items() for _ in range(share)]
    return row[number * 37 % len(row)]


def tried(to: Target, number: int) -> tuple[str, str]:
    """The kind of a request by its number, and the status of what came back.

    Raises:
        AssertionError: it told too much, or was no answer.
    """
    name, rng = kind_of(number), random.Random(f"stranger {number}")
    answer = KINDS[name][0](to, rng)
    try:
        return name, harmless(answer, SCRIPT.encode())
    except AssertionError as error:
        raise AssertionError(f"{name}, number {number}: {error}") from error
