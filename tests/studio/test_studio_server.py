"""The server of the pages against clients that are wrong, slow, many or foreign."""

import asyncio
import json
import re
import signal
import socket
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path
from typing import Any

import pytest

from dnnvss.errors import DnnvssError
from dnnvss.studio.bodies import DEPTH, read_body
from dnnvss.studio.page import Asked, Content, Page, Route, Seen
from dnnvss.studio.server import Server, ServerLimits

QUICK = ServerLimits(body=1000, connections=60, headers=0.6, sending=0.6, answering=5.0, ending=2.0)


def failing(asked: Asked) -> Any:
    raise RuntimeError("the secret of the house")


def mistaken(asked: Asked) -> Any:
    raise DnnvssError("is wrong", file=asked.names["name"], remedy="Mend it")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "sound.wav").write_bytes(bytes(range(256)))
    return tmp_path


@pytest.fixture
def server(folder: Path) -> Iterator[Server]:
    with serving(folder) as found:
        yield found


@contextmanager
def serving(folder: Path, limits: ServerLimits = QUICK, slow: Callable[[], None] = lambda: None) -> Iterator[Server]:
    def echo(asked: Asked) -> Any:
        slow()
        return {"names": dict(asked.names), "query": dict(asked.query), "body": asked.body}

    routes = (Route("POST", "/echo/{name}", echo), Route("GET", "/echo/{name}", echo),
              Route("GET", "/fails", failing), Route("GET", "/wrong/{name}", mistaken),
              Route("GET", "/sound", lambda asked: folder / "sound.wav"),
              Route("GET", "/gone", lambda asked: folder / "gone.wav"),
              Route("GET", "/nan", lambda asked: float("nan")),
              Route("GET", "/bytes", lambda asked: Content(b"abc", "image/png")))
    with Server(Page("labelling", routes), limits=limits) as found:
        yield found


def raw(server: Server, sent: bytes, wait: float = 5.0) -> bytes:
    """What a client gets that sends these bytes and waits until the server closes or is silent."""
    with socket.create_connection(("127.0.0.1", server.port), timeout=wait) as client:
        client.sendall(sent)
        return everything(client)


def everything(client: socket.socket) -> bytes:
    got = b""
    try:
        while part := client.recv(65536):
            got += part
    except (TimeoutError, ConnectionResetError):
        pass
    return got


def head(server: Server, line: str, *headers: str, body: bytes = b"", host: str | None = None) -> bytes:
    own = [line, f"Host: {host or f'127.0.0.1:{server.port}'}", "Connection: close", *headers]
    return "\r\n".join(own).encode() + b"\r\n\r\n" + body


def get(server: Server, path: str, *headers: str, **more: Any) -> bytes:
    return raw(server, head(server, f"GET {path} HTTP/1.1", *headers, **more))


def post(server: Server, body: bytes, *headers: str, path: str = "/echo/a", kind: str = "application/json") -> bytes:
    length = [] if any(h.lower().startswith(("content-length", "transfer")) for h in headers) else [
        f"Content-Length: {len(body)}"]
    return raw(server, head(server, f"POST {path} HTTP/1.1", f"Content-Type: {kind}", *length, *headers, body=body))


def status(answer: bytes) -> int:
    assert answer.startswith((b"HTTP/1.1 ", b"HTTP/1.0 ")), answer[:80]
    return int(answer[9:12])


def value(answer: bytes) -> Any:
    return json.loads(answer.partition(b"\r\n\r\n")[2])


def still_well(server: Server) -> None:
    assert value(post(server, b'{"a": [1]}'))["body"] == {"a": [1]}


# ---- what pages ask for ----------------------------------------------------------------------------------------------


def test_routes_name_parts_of_the_path_and_answers_are_of_three_kinds(server: Server) -> None:
    assert value(get(server, "/echo/a%20b%2Fc?x=1&y=%C3%A4")) == {
        "names": {"name": "a b/c"}, "query": {"x": "1", "y": "ä"}, "body": None}
    assert get(server, "/sound").endswith(bytes(range(256)))
    part = get(server, "/sound", "Range: bytes=10-12")
    assert status(part) == 206 and part.endswith(b"\r\n\r\n" + bytes([10, 11, 12]))
    image = get(server, "/bytes")
    assert b"Content-Type: image/png\r\n" in image and image.endswith(b"\r\n\r\nabc")
    assert value(post(server, b"[]"))["body"] == []
    assert raw(server, head(server, "HEAD /bytes HTTP/1.1")).endswith(b"\r\n\r\n")


def test_every_answer_tells_browsers_to_be_strict(server: Server) -> None:
    answers = [get(server, path) for path in ("/", "/page.js", "/bytes", "/sound", "/nothing", "/fails", "/wrong/a")]
    answers += [get(server, "/", host="evil.example"), raw(server, b"\0\0\0\r\n\r\n")]
    assert [status(a) for a in answers] == [200, 200, 200, 200, 404, 500, 400, 403, 400]
    for answer in answers:
        assert b"Content-Security-Policy: default-src 'self'" in answer
        assert b"X-Content-Type-Options: nosniff" in answer and b"Cache-Control: no-store" in answer


def test_mistakes_are_told_and_failures_keep_their_trace(server: Server, caplog: pytest.LogCaptureFixture) -> None:
    wrong = get(server, "/wrong/a.json")
    assert status(wrong) == 400 and value(wrong) == {"error": "a.json: is wrong. Mend it."}
    assert value(get(server, "/gone"))["error"].endswith("gone.wav: no such file")
    for path in ("/fails", "/nan"):
        failed = get(server, path)
        assert status(failed) == 500
        assert not any(word in failed for word in (b"secret", b"Traceback", b"RuntimeError", b".py"))
    assert "the secret of the house" in caplog.text  # the terminal says more
    still_well(server)


@pytest.mark.parametrize("path", ["/../../etc/passwd", "/..%2f..%2fetc/passwd", "/page.js/../../server.py",
                                  "//etc/passwd", "/labelling/page.js", "/%00", "/echo", "/echo/", "/echo/a/b", "/%ff",
                                  "/./page.js%00", "/__init__.py"])
def test_what_is_not_in_the_table_is_not_there(path: str, server: Server) -> None:
    answer = get(server, path)
    assert status(answer) == 404 and value(answer) == {"error": "there is no such page"}


# ---- who may ask -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "127.0.0.1:1", "", "localhost.evil.example:80"])
def test_other_names_of_this_machine_are_refused(host: str, server: Server) -> None:
    for path in ("/", "/echo/a", "/nothing"):
        assert status(get(server, path, host=host or " ")) in (400, 403)
    assert status(get(server, "/", host=f"localhost:{server.port}")) == 200
    assert status(get(server, "/", f"Host: localhost:{server.port}")) in (400, 403)
    assert status(raw(server, b"GET / HTTP/1.0\r\n\r\n")) == 403


@pytest.mark.parametrize("header", ["Origin: http://evil.example", "Origin: null", "Origin: http://localhost:1",
                                    "Origin: https://127.0.0.1:{port}", "Sec-Fetch-Site: cross-site",
                                    "Sec-Fetch-Site: same-site"])
@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS"])
def test_other_origins_may_change_nothing(header: str, method: str, server: Server) -> None:
    sent = head(server, f"{method} /echo/a HTTP/1.1", header.format(port=server.port), "Content-Length: 2",
                "Content-Type: application/json", body=b"{}")
    assert status(raw(server, sent)) == 403


def test_the_own_origin_and_no_browser_may(server: Server) -> None:
    for name in ("127.0.0.1", "localhost"):
        assert status(post(server, b"{}", f"Origin: http://{name}:{server.port}", "Sec-Fetch-Site: same-origin")) == 200
    assert status(post(server, b"{}")) == 200


def test_only_this_machine_can_reach_it(server: Server) -> None:
    assert server._socket.getsockname()[0] == "127.0.0.1"
    assert server.url == f"http://127.0.0.1:{server.port}/"


# ---- what may be sent ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("headers, expected", [
    (["Content-Length: -1"], {400}), (["Content-Length: 2", "Content-Length: 2"], {400}),
    (["Content-Length: 2", "Content-Length: 300"], {400}), (["Content-Length: 2, 2"], {400}),
    (["Content-Length: 1e3"], {400}), (["Content-Length: +2"], {400}), (["Content-Length: 9" + "9" * 20], {400}),
    (["Content-Length: 1001"], {413}), (["Content-Length: 9223372036854775807"], {413}),
    (["Transfer-Encoding: chunked"], {411}), (["Transfer-Encoding: chunked", "Content-Length: 2"], {400, 411}),
    (["Transfer-Encoding: gzip"], {400, 411}), (["Content-Length: 2", "Content-Encoding: gzip"], {200})])
def test_bodies_of_strange_lengths_are_refused_with_an_answer(
    headers: list[str], expected: set[int], server: Server
) -> None:
    chunked = "Transfer-Encoding: chunked" in headers
    answer = post(server, b"2\r\n{}\r\n0\r\n\r\n" if chunked else b"{}", *headers)
    assert status(answer) in expected, answer
    still_well(server)


def test_a_body_without_a_length_is_refused(server: Server) -> None:
    sent = head(server, "POST /echo/a HTTP/1.1", "Content-Type: application/json")
    assert status(raw(server, sent)) == 411


def test_a_large_body_is_refused_before_it_is_read(server: Server) -> None:
    answer = post(server, b"[" + b"1," * 498 + b"10]")
    assert status(answer) == 200
    with socket.create_connection(("127.0.0.1", server.port), timeout=5) as client:
        client.sendall(head(server, "POST /echo/a HTTP/1.1", "Content-Length: 1000000000",
                            "Content-Type: application/json"))
        assert status(client.recv(65536)) == 413  # not a byte of it was sent
    still_well(server)


@pytest.mark.parametrize("body", [b"", b"{", b"\xff\xfe", b"NaN", b'{"a": Infinity}', b"[" * 400, b"[" * 30 + b"]" * 30,
                                  b'{"a":' * 30 + b"1" + b"}" * 30, b"[1] [2]"])
def test_what_is_no_plain_json_is_refused(body: bytes, server: Server) -> None:
    answer = post(server, body)
    assert status(answer) == 400 and value(answer)["error"].startswith("what was sent is")


@pytest.mark.parametrize("kind", ["text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=x"])
def test_what_a_form_can_send_is_refused(kind: str, server: Server) -> None:
    assert status(post(server, b"{}", kind=kind)) == 415


def test_depth_is_counted() -> None:
    assert read_body(b"[" * DEPTH + b"]" * DEPTH) is not None
    assert read_body(b"[" * (DEPTH - 1) + b"1" + b"]" * (DEPTH - 1)) is not None
    with pytest.raises(DnnvssError, match="nested more than 20 deep"):
        read_body(b"[" * (DEPTH + 1) + b"]" * (DEPTH + 1))
    with pytest.raises(DnnvssError, match="nested"):
        read_body(b"[" * 200_000 + b"]" * 200_000)


@pytest.mark.parametrize("sent", [
    b"\r\n\r\n\r\n", b"GET\r\n\r\n", b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc", b"GET / HTTP/9.9\r\n\r\n",
    b"GET " + b"/a" * 9000 + b" HTTP/1.1\r\n\r\n", b"GET / HTTP/1.1\r\n" + b"A: b\r\n" * 500 + b"\r\n",
    b"GET / HTTP/1.1\r\nA: " + b"b" * 20000 + b"\r\n\r\n", b"GET / HTTP/1.1\r\nno colon\r\n\r\n", b"A" * 200_000])
def test_junk_is_answered_or_dropped_and_the_server_goes_on(sent: bytes, server: Server) -> None:
    answer = raw(server, sent)
    assert not answer or status(answer) in (400, 403)
    still_well(server)


def test_junk_behind_a_request_ends_the_connection(server: Server) -> None:
    good = head(server, "GET /bytes HTTP/1.1").replace(b"Connection: close\r\n", b"")
    answer = raw(server, good * 2 + b"\x00junk\r\n\r\n" + good)
    codes = [int(code) for code in re.findall(rb"HTTP/1\.\d (\d+)", answer)]
    assert codes[-1] == 400 and set(codes[:-1]) <= {200}
    assert re.findall(rb"HTTP/1\.1 (\d+)", raw(server, good * 3)) == [b"200"] * 3
    still_well(server)


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "TRACE", "CONNECT", "BREW"])
def test_methods_that_are_not_in_the_table_are_refused(method: str, server: Server) -> None:
    path = f"127.0.0.1:{server.port}" if method == "CONNECT" else "/bytes"
    assert status(raw(server, head(server, f"{method} {path} HTTP/1.1"))) in (400, 404, 405)
    still_well(server)


# ---- slow and many ---------------------------------------------------------------------------------------------------


def dripped(server: Server, start: bytes, seconds: float) -> tuple[bytes, float]:
    """What a client gets that sends a byte now and then, and after how many seconds the connection ends."""
    began = time.monotonic()
    with socket.create_connection(("127.0.0.1", server.port), timeout=0.05) as client:
        client.sendall(start)
        got = b""
        while time.monotonic() - began < seconds:
            try:
                part = client.recv(65536)
                if not part:
                    break
                got += part
            except TimeoutError:
                try:
                    client.sendall(b"x")
                except OSError:
                    break
            except ConnectionResetError:
                break
        return got, time.monotonic() - began


def test_slow_headers_and_slow_bodies_end(server: Server) -> None:
    _, took = dripped(server, b"GET / HTTP/1.1\r\nA: ", 6)
    assert took < 4
    body = head(server, "POST /echo/a HTTP/1.1", "Content-Length: 900", "Content-Type: application/json")
    got, took = dripped(server, body, 8)
    assert status(got) == 408 and took < 6
    _, took = dripped(server, b"", 6)
    assert took < 4
    still_well(server)


def test_an_idle_connection_ends(server: Server) -> None:
    with socket.create_connection(("127.0.0.1", server.port), timeout=6) as client:
        client.sendall(head(server, "GET /bytes HTTP/1.1").replace(b"Connection: close\r\n", b""))
        began = time.monotonic()
        assert everything(client).endswith(b"abc")
        assert 0.3 < time.monotonic() - began < 4


def test_a_client_that_takes_nothing_ends(folder: Path) -> None:
    (folder / "sound.wav").write_bytes(bytes(30_000_000))
    with serving(folder, ServerLimits(answering=0.5, headers=0.5, ending=0.5)) as server, \
            socket.create_connection(("127.0.0.1", server.port), timeout=6) as client:
        client.sendall(head(server, "GET /sound HTTP/1.1"))
        time.sleep(1.5)
        assert len(everything(client)) < 30_000_000
        still_well(server)


def test_fifty_clients_at_once_are_all_answered(server: Server) -> None:
    with ThreadPoolExecutor(50) as clients:
        answers = list(clients.map(lambda k: value(post(server, json.dumps(k).encode()))["body"], range(50)))
    assert answers == list(range(50))


def test_connections_are_bounded(folder: Path) -> None:
    go, limits = threading.Event(), ServerLimits(connections=3, headers=20)
    with serving(folder, limits, slow=lambda: go.wait(5) and None) as server, ThreadPoolExecutor(3) as clients:
        asked = [clients.submit(get, server, "/echo/a") for _ in range(3)]
        time.sleep(0.3)
        with socket.create_connection(("127.0.0.1", server.port), timeout=5) as client:
            refused = everything(client)
        go.set()
        assert status(refused) == 503 and b"Retry-After: 1\r\n" in refused
        assert [status(each.result()) for each in asked] == [200] * 3
        still_well(server)


def test_who_holds_connections_and_asks_nothing_keeps_nobody_out(folder: Path) -> None:
    with serving(folder, ServerLimits(connections=3, headers=20)) as server:
        held = [socket.create_connection(("127.0.0.1", server.port), timeout=5) for _ in range(9)]
        for client in held[-3:]:
            client.sendall(b"GET / HTTP/1.1\r\nA: ")
        time.sleep(0.2)
        try:
            still_well(server)
            assert held[0].recv(9) == b""
        finally:
            for client in held:
                client.close()


def test_who_waits_for_a_coroutine_and_leaves_ends_it(folder: Path) -> None:
    told = list[str]()
    left = threading.Event()

    async def waits(asked: Asked) -> Any:
        told.append("begun")
        try:
            await asyncio.sleep(20)
        except asyncio.CancelledError:
            left.set()
            raise

    seen = list[Seen]()
    page = Page("labelling", (Route("GET", "/waits/{name}", waits),), seen=seen.append)
    with Server(page, limits=QUICK) as server:
        with socket.create_connection(("127.0.0.1", server.port), timeout=5) as client:
            client.sendall(head(server, "GET /waits/a HTTP/1.1"))
            while not told:
                time.sleep(0.01)
        assert left.wait(3)
        assert status(get(server, "/nothing")) == 404
    assert [(each.method, each.route, each.status) for each in seen] == [("GET", "/waits/{name}", 499),
                                                                         ("GET", "", 404)]


@pytest.mark.parametrize("header", ["Sec-WebSocket-Version: 99", "Sec-WebSocket-Key: short", "Connection: keep-alive",
                                    "Sec-WebSocket-Key: \xc3("])
def test_a_handshake_that_is_none_is_refused(header: str, caplog: pytest.LogCaptureFixture) -> None:
    own = {"Sec-WebSocket-Version": "13", "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==", "Connection": "Upgrade"}
    name, _, wrong = header.partition(": ")
    lines = [f"{each}: {text}" for each, text in (own | {name: wrong}).items()]
    with Server(Page("labelling", (Route("STREAM", "/s", streamed),)), limits=QUICK) as server:
        asked = head(server, "GET /s HTTP/1.1", "Upgrade: websocket", *lines)
        answer = raw(server, asked.replace(b"Connection: close\r\n", b"").replace(b"\xc3\x83", b"\xc3"))
    assert status(answer) == 400 and not caplog.text


async def streamed(asked: Asked) -> AsyncIterator[str]:
    yield "a"


def test_what_is_there_around_a_page_begins_and_ends_with_it(folder: Path) -> None:
    told = list[str]()

    @asynccontextmanager
    async def around() -> AsyncIterator[None]:
        told.append("begun")
        yield
        told.append("ended")

    with Server(Page("labelling", (), around=around), limits=QUICK) as server:
        get(server, "/")
        assert told == ["begun"]
    assert told == ["begun", "ended"]


def test_bodies_of_bytes_are_taken_so_many_at_a_time(folder: Path) -> None:
    page = Page("labelling", (Route("POST", "/bring", lambda asked: len(asked.body), bytes_most=5000),))
    kind = "application/octet-stream"
    with Server(page, limits=ServerLimits(bringing=1, sending=5)) as server, \
            socket.create_connection(("127.0.0.1", server.port), timeout=5) as slow:
        slow.sendall(head(server, "POST /bring HTTP/1.1", f"Content-Type: {kind}", "Content-Length: 3", body=b"ab"))
        time.sleep(0.2)
        refused = post(server, b"abc", path="/bring", kind=kind)
        assert status(refused) == 503 and b"Retry-After" in refused
        slow.sendall(b"c")
        assert value(everything(slow)) == 3
        assert value(post(server, b"a" * 5000, path="/bring", kind=kind)) == 5000


def test_a_request_at_work_is_finished_when_the_server_ends(folder: Path) -> None:
    begun, answers = threading.Event(), []

    def slow() -> None:
        begun.set()
        time.sleep(0.6)

    with serving(folder, slow=slow) as server:
        client = threading.Thread(target=lambda: answers.append(get(server, "/echo/a")))
        client.start()
        assert begun.wait(5)
    client.join(5)
    assert status(answers[0]) == 200 and value(answers[0])["names"] == {"name": "a"}


@pytest.fixture
def heeded() -> Iterator[None]:
    """Ctrl-C is heard, even where the tests were started by a shell that lets its background ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("heeded")
def test_ctrl_c_ends_the_server_in_order(folder: Path) -> None:
    begun, told = threading.Event(), list[str]()

    @asynccontextmanager
    async def around() -> AsyncIterator[None]:
        yield
        told.append("ended")

    async def slow(asked: Asked) -> str:
        begun.set()
        await asyncio.sleep(0.5)
        return await asyncio.to_thread(lambda: "done")

    ctrl_c = threading.Timer(0.1, signal.pthread_kill, (threading.get_ident(), signal.SIGINT))
    with ThreadPoolExecutor(1) as clients:
        with Server(Page("labelling", (Route("GET", "/slow", slow),), around=around), limits=QUICK) as server:
            answer = clients.submit(get, server, "/slow")
            assert begun.wait(5)
            ctrl_c.start()
            with pytest.raises(KeyboardInterrupt):
                server.wait()
        assert told == ["ended"] and value(answer.result(5)) == "done"


def test_a_port_that_is_taken_is_said(server: Server) -> None:
    for port, said in ((server.port, "Address already in use"), (70000, "0 to 65535")):
        with pytest.raises(DnnvssError, match=f"port {port} cannot be used .*{said}"):
            Server(Page("labelling", ()), port)


def test_with_a_token_only_who_brings_it_gets_in(folder: Path) -> None:
    page = Page("labelling", (Route("GET", "/sound", lambda asked: folder / "sound.wav"),))
    with Server(page, limits=QUICK, token="secret") as server:
        assert b" 401 " in head_of(server, "GET /sound HTTP/1.1")
        assert b" 401 " in head_of(server, "GET /sound HTTP/1.1", "Authorization: Bearer other")
        assert b" 200 " in head_of(server, "GET /sound HTTP/1.1", "Authorization: Bearer secret")
        assert b" 401 " in head_of(server, "GET /?token=secre HTTP/1.1")
        entered = raw(server, head(server, "GET /?token=secret HTTP/1.1"))
        assert b" 200 " in entered.splitlines()[0]
        cookie = re.search(rb"Set-Cookie: ([^;]+);", entered)
        assert cookie is not None and b"HttpOnly" in entered and b"SameSite=Strict" in entered
        assert b" 200 " in head_of(server, "GET /sound HTTP/1.1", f"Cookie: {cookie[1].decode()}")
        assert b" 401 " in head_of(server, "GET /sound?token=secret HTTP/1.1")


def head_of(server: Server, line: str, *headers: str) -> bytes:
    return raw(server, head(server, line, *headers)).splitlines()[0] + b" "
