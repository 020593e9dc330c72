"""Answers of the server: what a handler gave or what is wrong, with headers that tell browsers to be strict."""

import json
from pathlib import Path
from typing import Any

from aiohttp import web
from aiohttp.abc import AbstractStreamWriter

from dnnvss.errors import DnnvssError
from dnnvss.studio.page import POLICY, Content, Document

_HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Server": "dnnvss",
    "Cross-Origin-Resource-Policy": "same-origin",
}


class Refused(Exception):  # noqa: N818
    """A request that is not handled: status, what is said, and whether the connection is of no more use."""

    def __init__(self, status: int, said: str, close: bool = False, **headers: str) -> None:
        super().__init__(said)
        self.status, self.close, self.headers = status, close, headers


class _File(web.FileResponse):
    """A file that is opened once, though it is prepared here and by the library behind it."""

    async def prepare(self, request: web.BaseRequest) -> AbstractStreamWriter | None:
        """Send it, unless that has been done."""
        return None if self.prepared else await super().prepare(request)


def answer_of(value: Any) -> web.StreamResponse:
    """The answer of what a handler gave.

    Raises:
        DnnvssError: a file that is not there.
    """
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


def refusal(status: int, said: str, close: bool = False, headers: dict[str, str] | None = None) -> web.Response:
    """An answer that says what is wrong.

    Args:
        status: of HTTP.
        said: to the client.
        close: whether the connection is of no more use.
        headers: further ones.
    """
    text = json.dumps({"error": said.strip()}).encode()
    answer = web.Response(status=status, body=text,
                          headers={"Content-Type": "application/json", **_HEADERS, **(headers or {})})
    if close:
        answer.force_close()
    return answer
