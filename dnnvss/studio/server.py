"""The server of all pages: one small server for this machine, hard to crash, to stall and to misuse.

Only pages that it gave out may change anything (``Host`` and ``Origin`` are checked), bodies are bounded before they
are read, every wait has an end, and nothing of a traceback leaves the process.
"""

import asyncio
import json
import logging
import os
import socket
import threading
import time
from collections.abc import AsyncGenerator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import aclosing, suppress
from dataclasses import dataclass
from hmac import compare_digest
from inspect import iscoroutinefunction
from pathlib import Path
from types import TracebackType
from typing import Any
from urllib.parse import unquote

from aiohttp import web
from aiohttp.abc import AbstractStreamWriter
from aiohttp.http import RawRequestMessage

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.studio.bodies import read_body
from dnnvss.studio.page import POLICY, STREAM, Asked, BusyError, Content, Document, Page, Route, Seen

_HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Server": "dnnvss",
    "Cross-Origin-Resource-Policy": "same-origin",
}
_READING = ("GET", "HEAD")
"""Methods that change nothing."""
_BUSY = b"HTTP/1.1 503 Service Unavailable\r\nRetry-After: 1\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
_LEFT = 499
"""The status of a request whose client left before the answer, as it is written of by other servers too."""
_COOKIE = "dnnvss"
_ROUTE, _NOTES = web.RequestKey("route", str), web.RequestKey("notes", dict)
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class ServerLimits:
    """What a client may use up.

    Args:
        body: bytes that are sent with a request.
        connections: open at a time; where there are as many, one that asks for nothing makes room for the next.
        bringing: bodies of bytes that are taken at a time.
        threads: that handlers may keep busy.
        headers: seconds until a request has begun, of a new connection or after the answer before.
        sending: seconds in which the body has to arrive.
        answering: seconds in which an answer has to be taken.
        ending: seconds that the requests at work have when the server ends.
    """

    body: int = 1_000_000
    connections: int = 100
    bringing: int = 8
    threads: int = 32
    headers: float = 30.0
    sending: float = 30.0
    answering: float = 300.0
    ending: float = 10.0


class _Refused(Exception):  # noqa: N818
    """A request that is not handled: status, what is said, and whether the connection is of no more use."""

    def __init__(self, status: int, said: str, close: bool = False, **headers: str) -> None:
        super().__init__(said)
        self.status, self.close, self.headers = status, close, headers


class Server:
    """Serves a page until it is left: ``with Server(page) as server: ...``; ``url`` says where.

    Args:
        page: what is served.
        port: 0 takes a free one.
        host: the address to listen on; others than this machine's own let other machines in.
        limits: what a client may use up.
        token: what every request has to bring, as ``Authorization: Bearer TOKEN`` or, once, as ``/?token=TOKEN``, which
            leaves a cookie; None where this machine alone gets in.
        names: others by which it is reached, with their port where it is not the usual one: those of a proxy.

    Raises:
        DnnvssError: the port cannot be used.
    """

    def __init__(self, page: Page, port: int = 0, host: str = "127.0.0.1", limits: ServerLimits | None = None,
                 token: str | None = None, names: Sequence[str] = ()) -> None:
        self.page, self.limits = page, limits or ServerLimits()
        remedy = "Give another one, or --port 0 for a free one"
        if not 0 <= port <= 65535:
            raise DnnvssError(f"port {port} cannot be used (there are 0 to 65535)", remedy=remedy)
        try:
            self._socket = socket.create_server((host, port))
        except OSError as error:
            why = os.strerror(error.errno) if error.errno else str(error)
            raise DnnvssError(f"port {port} cannot be used ({why})", remedy=remedy) from error
        self.port = int(self._socket.getsockname()[1])
        self._host, self._token = host, token
        own = {host, "localhost"} if host == "127.0.0.1" else {host}
        self._names = {f"{name}:{self.port}" for name in own} | (own if self.port == 80 else set())
        self._origins = {f"http://{name}" for name in self._names}
        self._origins |= {f"{scheme}://{name.lower()}" for name in names for scheme in ("http", "https")}
        self._names |= {name.lower() for name in names}
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()), name="studio", daemon=True)
        self._ready, self._over = threading.Event(), threading.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._end: asyncio.Event | None = None
        self._sending = set[asyncio.Future[None]]()

    @property
    def url(self) -> str:
        """Where the page is."""
        return f"http://{self._host}:{self.port}/"

    def __enter__(self) -> "Server":
        self._thread.start()
        self._ready.wait()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        """End after the requests that are at work."""
        if self._loop is not None and self._end is not None:
            with suppress(RuntimeError):  # it has ended
                self._loop.call_soon_threadsafe(self._end.set)
        self._thread.join()
        self._socket.close()

    def wait(self) -> None:
        """Wait until the server ends, or Ctrl-C (a ``KeyboardInterrupt``)."""
        while not self._over.wait(1.0):  # a join that Ctrl-C ends would take the thread for ended
            pass

    async def _serve(self) -> None:
        try:
            self._loop, self._end = asyncio.get_running_loop(), asyncio.Event()
            self._loop.set_default_executor(ThreadPoolExecutor(self.limits.threads, "page"))
            self._bringing = asyncio.Semaphore(self.limits.bringing)
            async with self.page.around():
                await self._listen(self._loop, self._end)
        finally:
            self._ready.set()
            self._over.set()

    async def _listen(self, loop: asyncio.AbstractEventLoop, end: asyncio.Event) -> None:
        manager = web.Server(self._answer, request_factory=self._request, handler_cancellation=True)
        listening = await loop.create_server(lambda: _Connection(manager, self.limits), sock=self._socket)
        self._ready.set()
        await end.wait()
        listening.close()
        manager.pre_shutdown()
        await manager.shutdown(self.limits.ending)
        if self._sending:
            await asyncio.wait(self._sending, timeout=self.limits.ending)

    def _request(self, message: RawRequestMessage, payload: Any, protocol: Any, writer: Any, task: Any
                 ) -> web.BaseRequest:
        most = max(self.limits.body, *(route.bytes_most for route in self.page.routes), 0)
        return web.BaseRequest(message, payload, protocol, writer, task, protocol._loop, client_max_size=most)

    async def _answer(self, request: web.BaseRequest) -> web.StreamResponse:
        """Answer a request, wait until the client has taken the answer, and tell the page of it."""
        begun, response = time.monotonic(), None
        try:
            response = await self._answered(request)
            return response
        finally:
            self.page.seen(_seen(request, response, time.monotonic() - begun))

    async def _answered(self, request: web.BaseRequest) -> web.StreamResponse:
        try:
            self._check_origin(request)
            if (route := self._streaming(request)) is not None:
                return await self._stream(request, route)
            response = await self._handled(request)
        except _Refused as refused:
            response = _error(refused.status, str(refused), refused.close, refused.headers)
        except BusyError as error:
            response = _error(503, str(error), headers={"Retry-After": str(error.seconds)})
        except DnnvssError as error:
            response = _error(400, str(error))
        except OSError as error:
            response = _error(400, f"{error.filename or 'the disk'}: {error.strerror}. {files.remedy_for(error) or ''}")
        except Exception:
            _LOG.exception("a page asked for %s and this failed", request.path)
            response = _error(500, "the server failed at this; the terminal in which it runs says more")
        sending = asyncio.ensure_future(self._send(request, response))
        self._sending.add(sending)
        sending.add_done_callback(self._sending.discard)
        await asyncio.shield(sending)  # a file that is open is closed, though the client left
        return response

    async def _send(self, request: web.BaseRequest, response: web.StreamResponse) -> None:
        try:
            async with asyncio.timeout(self.limits.answering):
                await response.prepare(request)
                await response.write_eof()
        except TimeoutError:
            if request.transport is not None:
                request.transport.abort()
        except ConnectionError:  # nobody is there to take it
            pass

    def _check_origin(self, request: web.BaseRequest) -> None:
        """Refuse what no page of this server sent: other names of this machine, and other pages in the browser."""
        if len(hosts := request.headers.getall("Host", [])) != 1 or hosts[0].lower() not in self._names:
            raise _Refused(403, "this page is for this machine alone", close=True)
        self._check_token(request)
        if request.method not in _READING:
            self._check_sender(request)

    def _check_token(self, request: web.BaseRequest) -> None:
        """Refuse who does not bring the token, where there is one."""
        brought = [request.headers.get("Authorization", "").removeprefix("Bearer "), request.cookies.get(_COOKIE, ""),
                   request.query.get("token", "") if request.path == "/" else ""]
        if self._token and not any(compare_digest(each.encode(), self._token.encode()) for each in brought):
            raise _Refused(401, "the token is missing or wrong", close=True)

    def _check_sender(self, request: web.BaseRequest) -> None:
        """Refuse what another page in the browser sent."""
        origins = request.headers.getall("Origin", [])
        if any(origin.lower() not in self._origins for origin in origins):
            raise _Refused(403, "another page may not change anything here", close=True)
        if request.headers.get("Sec-Fetch-Site", "same-origin") not in ("same-origin", "none"):
            raise _Refused(403, "another page may not change anything here", close=True)

    def _streaming(self, request: web.BaseRequest) -> Route | None:
        """The route of a WebSocket, None for all that is none; pages of others may not open one."""
        if request.headers.get("Upgrade", "").lower() != "websocket":
            return None
        self._check_sender(request)
        path = request.rel_url.raw_path
        found = next((route for route in self.page.routes if route.method == STREAM and route.path == path), None)
        if found is None:
            raise _Refused(404, "nothing streams here", close=True)
        return found

    async def _stream(self, request: web.BaseRequest, route: Route) -> web.StreamResponse:
        """Read one message and send what the handler makes of it until it ends or the client leaves."""
        socket = web.WebSocketResponse(max_msg_size=self.limits.body, heartbeat=self.limits.headers,
                                       receive_timeout=self.limits.sending)
        try:
            await socket.prepare(request)
        except (web.HTTPException, ValueError):  # the library's words would repeat what was sent
            raise _Refused(400, "this is no handshake of a WebSocket", close=True) from None
        request[_ROUTE] = route.path
        try:
            asked = Asked(body=read_body((await socket.receive_str()).encode()))
            request[_NOTES] = asked.notes
            made: AsyncGenerator[str | bytes] = route.handler(asked)
            async with aclosing(made):
                async for part in made:
                    async with asyncio.timeout(self.limits.answering):
                        await (socket.send_str(part) if isinstance(part, str) else socket.send_bytes(part))
        except DnnvssError as error:
            await _told(socket, str(error))
        except (TypeError, TimeoutError, ConnectionError):  # no text came, or nobody takes what is sent
            pass
        except Exception:
            _LOG.exception("a client streamed %s and this failed", request.path)
            await _told(socket, "the server failed at this; the terminal in which it runs says more")
        finally:
            await socket.close()
        return socket

    async def _handled(self, request: web.BaseRequest) -> web.StreamResponse:
        parts = [unquote(part) for part in request.rel_url.raw_path.split("/")[1:]]
        page = self.page
        if len(parts) > 1:
            page, parts = await asyncio.to_thread(page.within, parts)
        if request.method in _READING and len(parts) == 1 and (file := page.static().get(f"/{parts[0]}")):
            request[_ROUTE] = f"/{parts[0]}"
            response = _response(file)
            if self._token and request.query.get("token"):
                response.set_cookie(_COOKIE, self._token, httponly=True, samesite="Strict")
            return response
        fitting = [(route, names) for route in page.routes if (names := route.match(parts)) is not None]
        method = "GET" if request.method == "HEAD" else request.method
        for route, names in fitting:
            if route.method == method:
                request[_ROUTE] = route.path
                body = None if method == "GET" else await self._body(request, route)
                asked = Asked(names, dict(request.query), body)
                request[_NOTES] = asked.notes
                if iscoroutinefunction(route.handler):
                    return _response(await route.handler(asked))
                return _response(await asyncio.to_thread(route.handler, asked))
        if fitting:
            allowed = ", ".join(sorted({route.method for route, _ in fitting}))
            raise _Refused(405, f"{request.method} is not done here", close=True, Allow=allowed)
        raise _Refused(404, "there is no such page", close=request.method not in _READING)

    async def _body(self, request: web.BaseRequest, route: Route) -> Any:
        """What was sent, once it is known how long it is: JSON, or the bytes where the route takes these."""
        most = route.bytes_most or self.limits.body
        if request.content_length is None or "Transfer-Encoding" in request.headers:
            raise _Refused(411, "the length of what is sent has to be said", close=True)
        if request.content_length > most:
            raise _Refused(413, f"more than {most} bytes are not taken", close=True)
        kind = "application/octet-stream" if route.bytes_most else "application/json"
        if request.content_type != kind:
            raise _Refused(415, f"only {kind} is taken", close=True)
        if not route.bytes_most:
            return read_body(await self._read(request))
        if self._bringing.locked():
            raise _Refused(503, "too many are bringing something; bring it again in a moment", close=True,
                           **{"Retry-After": "2"})
        async with self._bringing:
            return await self._read(request)

    async def _read(self, request: web.BaseRequest) -> bytes:
        try:
            async with asyncio.timeout(self.limits.sending):
                return await request.read()
        except TimeoutError:
            raise _Refused(408, "the rest was waited for too long", close=True) from None


def _seen(request: web.BaseRequest, response: web.StreamResponse | None, seconds: float) -> Seen:
    method = request.method if request.method in (*_READING, "POST") else "OTHER"
    sent = response.content_length if isinstance(response, web.Response) else None
    return Seen(method, request.get(_ROUTE, ""), _LEFT if response is None else response.status, seconds,
                request.content_length or 0, sent or 0, request.get(_NOTES, {}))


async def _told(socket: web.WebSocketResponse, said: str) -> None:
    """Say what is wrong, if somebody still listens."""
    with suppress(ConnectionError, RuntimeError):
        await socket.send_str(json.dumps({"error": said}))


class _Connection(web.RequestHandler):
    """A connection: one of a bounded number, and what is no HTTP is answered in the words of this server."""

    __slots__ = ("_most",)

    def __init__(self, manager: web.Server, limits: ServerLimits) -> None:
        super().__init__(manager, loop=asyncio.get_running_loop(), keepalive_timeout=limits.headers, access_log=_QUIET,
                         logger=_QUIET, max_headers=64, lingering_time=min(2.0, limits.sending),
                         auto_decompress=False)
        self._most = limits.connections

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take a connection; where there are too many, in the place of the one that asked for nothing the longest."""
        held = [] if self._manager is None else self._manager.connections
        idle = [own for own in held if isinstance(own, _Connection) and own._current_request is None]
        if len(held) >= self._most and idle:
            min(idle, key=lambda own: own._next_keepalive_close_time).force_close()
        elif len(held) >= self._most:
            assert isinstance(transport, asyncio.Transport)
            transport.write(_BUSY)
            transport.close()
            self.force_close()
            return
        super().connection_made(transport)

    def handle_error(self, request: web.BaseRequest, status: int = 500, exc: BaseException | None = None,
                     message: str | None = None) -> web.StreamResponse:
        """Answer what is no HTTP; aiohttp's own text would repeat what was sent."""
        return _error(status, "this is no request that can be read", close=True)


_QUIET = logging.getLogger(f"{__name__}.connections")
_QUIET.setLevel(logging.CRITICAL + 1)  # what strangers send is not written into the terminal


class _File(web.FileResponse):
    """A file that is opened once, though it is prepared here and by the library behind it."""

    async def prepare(self, request: web.BaseRequest) -> AbstractStreamWriter | None:
        """Send it, unless that has been done."""
        return None if self.prepared else await super().prepare(request)


def _response(value: Any) -> web.StreamResponse:
    """The answer of what a handler gave."""
    policy = {}
    if isinstance(value, Document):
        value, policy = value.path, {"Content-Security-Policy": value.policy}
    if isinstance(value, Path):
        if not value.is_file():
            raise DnnvssError("no such file", file=value)
        return _File(value, headers=_HEADERS | policy)
    if not isinstance(value, Content):
        value = Content(json.dumps(value, allow_nan=False).encode(), "application/json")
    return web.Response(body=value.body, headers={"Content-Type": value.kind, **_HEADERS})


def _error(status: int, said: str, close: bool = False, headers: dict[str, str] | None = None) -> web.Response:
    text = json.dumps({"error": said.strip()}).encode()
    response = web.Response(status=status, body=text,
                            headers={"Content-Type": "application/json", **_HEADERS, **(headers or {})})
    if close:
        response.force_close()
    return response
