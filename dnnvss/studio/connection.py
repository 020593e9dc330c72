"""A connection to the server, one of a bounded number."""

import asyncio
import logging

from aiohttp import web

from dnnvss.studio.answers import refusal

_BUSY = b"HTTP/1.1 503 Service Unavailable\r\nRetry-After: 1\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
_QUIET = logging.getLogger(__name__)
_QUIET.setLevel(logging.CRITICAL + 1)  # what strangers send is not written into the terminal


class Connection(web.RequestHandler):
    """A connection: one of a bounded number, and what is no HTTP is answered in the words of this server.

    Args:
        manager: of all connections.
        most: that are open at a time.
        patience: seconds until a request has begun.
        lingering: seconds for which a connection that is refused is still read.
    """

    __slots__ = ("_most",)

    def __init__(self, manager: web.Server, most: int, patience: float, lingering: float) -> None:
        super().__init__(manager, loop=asyncio.get_running_loop(), keepalive_timeout=patience, access_log=_QUIET,
                         logger=_QUIET, max_headers=64, lingering_time=lingering, auto_decompress=False)
        self._most = most

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take a connection; where there are too many, in the place of the one that asked for nothing the longest."""
        held = [] if self._manager is None else self._manager.connections
        idle = [own for own in held if isinstance(own, Connection) and own._current_request is None]
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
        return refusal(status, "this is no request that can be read", close=True)
