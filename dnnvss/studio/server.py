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
from inspect import iscoroutinefunction
from types import TracebackType
from typing import Any
from urllib.parse import unquote

from aiohttp import web
from aiohttp.http import RawRequestMessage

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.studio.answers import Refused, answer_of, refusal
from dnnvss.studio.bodies import read_body
from dnnvss.studio.connection import Connection
from dnnvss.studio.door import READING, Door
from dnnvss.studio.page import STREAM, Asked, BusyError, Page, Route, Seen

_LEFT = 499
"""The status of a request whose client left before the answer, as it is written of by other servers too."""
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
        self._host, self._door = host, Door.of(host, self.port, token, names)
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
        limits = self.limits
        manager = web.Server(self._answer, request_factory=self._request, handler_cancellation=True)
        bounds = limits.connections, limits.headers, min(2.0, limits.sending)
        listening = await loop.create_server(lambda: Connection(manager, *bounds), sock=self._socket)
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
            self._door.check(request)
            if (route := self._streaming(request)) is not None:
                return await self._stream(request, route)
            response = await self._handled(request)
        except Refused as refused:
            response = refusal(refused.status, str(refused), refused.close, refused.headers)
        except BusyError as error:
            response = refusal(503, str(error), headers={"Retry-After": str(error.seconds)})
        except DnnvssError as error:
            response = refusal(400, str(error))
        except OSError as error:
            what = f"{error.filename or 'the disk'}: {error.strerror}. {files.remedy_for(error) or ''}"
            response = refusal(400, what)
        except Exception:
            _LOG.exception("a page asked for %s and this failed", request.path)
            response = refusal(500, "the server failed at this; the terminal in which it runs says more")
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

    def _streaming(self, request: web.BaseRequest) -> Route | None:
        """The route of a WebSocket, None for all that is none; pages of others may not open one."""
        if request.headers.get("Upgrade", "").lower() != "websocket":
            return None
        self._door.check_sender(request)
        path = request.rel_url.raw_path
        found = next((route for route in self.page.routes if route.method == STREAM and route.path == path), None)
        if found is None:
            raise Refused(404, "nothing streams here", close=True)
        return found

    async def _stream(self, request: web.BaseRequest, route: Route) -> web.StreamResponse:
        """Read one message and send what the handler makes of it until it ends or the client leaves."""
        socket = web.WebSocketResponse(max_msg_size=self.limits.body, heartbeat=self.limits.headers,
                                       receive_timeout=self.limits.sending)
        try:
            await socket.prepare(request)
        except (web.HTTPException, ValueError):  # the library's words would repeat what was sent
            raise Refused(400, "this is no handshake of a WebSocket", close=True) from None
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
        if request.method in READING and len(parts) == 1 and (file := page.static().get(f"/{parts[0]}")):
            request[_ROUTE] = f"/{parts[0]}"
            answer = answer_of(file)
            self._door.remember(request, answer)
            return answer
        fitting = [(route, names) for route in page.routes if (names := route.match(parts)) is not None]
        method = "GET" if request.method == "HEAD" else request.method
        for route, names in fitting:
            if route.method == method:
                request[_ROUTE] = route.path
                body = None if method == "GET" else await self._body(request, route)
                asked = Asked(names, dict(request.query), body)
                request[_NOTES] = asked.notes
                if iscoroutinefunction(route.handler):
                    return answer_of(await route.handler(asked))
                return answer_of(await asyncio.to_thread(route.handler, asked))
        if fitting:
            allowed = ", ".join(sorted({route.method for route, _ in fitting}))
            raise Refused(405, f"{request.method} is not done here", close=True, Allow=allowed)
        raise Refused(404, "there is no such page", close=request.method not in READING)

    async def _body(self, request: web.BaseRequest, route: Route) -> Any:
        """What was sent, once it is known how long it is: JSON, or the bytes where the route takes these."""
        most = route.bytes_most or self.limits.body
        if request.content_length is None or "Transfer-Encoding" in request.headers:
            raise Refused(411, "the length of what is sent has to be said", close=True)
        if request.content_length > most:
            raise Refused(413, f"more than {most} bytes are not taken", close=True)
        kind = "application/octet-stream" if route.bytes_most else "application/json"
        if request.content_type != kind:
            raise Refused(415, f"only {kind} is taken", close=True)
        if not route.bytes_most:
            return read_body(await self._read(request))
        if self._bringing.locked():
            raise Refused(503, "too many are bringing something; bring it again in a moment", close=True,
                           **{"Retry-After": "2"})
        async with self._bringing:
            return await self._read(request)

    async def _read(self, request: web.BaseRequest) -> bytes:
        try:
            async with asyncio.timeout(self.limits.sending):
                return await request.read()
        except TimeoutError:
            raise Refused(408, "the rest was waited for too long", close=True) from None


def _seen(request: web.BaseRequest, response: web.StreamResponse | None, seconds: float) -> Seen:
    method = request.method if request.method in (*READING, "POST") else "OTHER"
    sent = response.content_length if isinstance(response, web.Response) else None
    return Seen(method, request.get(_ROUTE, ""), _LEFT if response is None else response.status, seconds,
                request.content_length or 0, sent or 0, request.get(_NOTES, {}))


async def _told(socket: web.WebSocketResponse, said: str) -> None:
    """Say what is wrong, if somebody still listens."""
    with suppress(ConnectionError, RuntimeError):
        await socket.send_str(json.dumps({"error": said}))
