"""What a page of the studio is: static files of the package, and a table of routes with their handlers."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, nullcontext
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files as package_files
from pathlib import Path, PurePath
from typing import Any

from dnnvss.errors import DnnvssError
from dnnvss.pages import PALETTE, style

_KINDS = {".html": "text/html; charset=utf-8", ".css": "text/css; charset=utf-8",
          ".js": "text/javascript; charset=utf-8", ".svg": "image/svg+xml", ".png": "image/png"}
"""Kinds of static files by suffix; others are not served."""

POLICY = "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
"""What a page of this package may load, and who may show it: nothing and nobody but this server."""


@dataclass(frozen=True)
class Asked:
    """A request as its handler sees it.

    Args:
        names: the parts of the path that the route names, decoded.
        query: what stands behind the question mark.
        body: the value of the JSON sent, None where there is none; the bytes where the route takes bytes.
        notes: what the handler leaves for :class:`Seen`.
    """

    names: Mapping[str, str] = field(default_factory=dict)
    query: Mapping[str, str] = field(default_factory=dict)
    body: Any = None
    notes: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Seen:
    """A request that is over, for counts and logs: nothing in it is what somebody wrote.

    Args:
        method: GET, POST; others as ``OTHER``.
        route: the path of the :class:`Route`, with its parts in braces; empty where nothing was found.
        status: of the answer; 499 where the client left before it.
        seconds: from the first byte of the request to the last of the answer.
        received: bytes of the body.
        sent: bytes of the answer, as far as they are known.
        notes: of the handler.
    """

    method: str
    route: str
    status: int
    seconds: float
    received: int = 0
    sent: int = 0
    notes: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Content:
    """Bytes to answer with, and their kind, e.g. ``image/png``."""

    body: bytes
    kind: str


@dataclass(frozen=True)
class Document:
    """A file to answer with that was written as a page of its own, and what it may do.

    Args:
        path: of the file.
        policy: its content policy, in place of that of the pages of this package.
    """

    path: Path
    policy: str


Handler = Callable[[Asked], Any]
"""Runs in a thread of its own, or is a coroutine function, which is cancelled when the client leaves. It answers with
plain containers (sent as JSON), :class:`Content`, the path of a file, or a :class:`Document`; what is wrong with the
request is a ``DnnvssError``, whose text the page is sent."""


class BusyError(DnnvssError):
    """A request that cannot be worked on now and may be sent again in a moment: :attr:`seconds`."""

    seconds = 1

    def after(self, seconds: int) -> "BusyError":
        """The same, to be sent again after so many seconds, a minute at most."""
        self.seconds = min(max(1, seconds), 60)
        return self


STREAM = "STREAM"
"""Stands for the method of a route that is a WebSocket."""


@dataclass(frozen=True)
class Route:
    """A method and a path such as ``/points/{image}``, and who handles them.

    Args:
        method: GET, POST, or STREAM for a WebSocket: the handler, an asynchronous generator, is given the first
            message, which is JSON, and what it yields is sent, text or bytes, as fast as the client takes it; it is
            closed when the client leaves.
        path: parts in braces are named.
        handler: what answers.
        about: what it does, in half a sentence.
        bytes_most: how many bytes it takes as they are; 0 where it takes JSON.
    """

    method: str
    path: str
    handler: Handler
    about: str = ""
    bytes_most: int = 0

    def match(self, parts: Sequence[str]) -> dict[str, str] | None:
        """The named parts of a path, None where it is another one.

        Args:
            parts: of the path between its slashes, decoded.
        """
        own = self.path.split("/")[1:]
        if len(own) != len(parts):
            return None
        named = {o[1:-1]: part for o, part in zip(own, parts, strict=True) if o.startswith("{")}
        same = all(o.startswith("{") or o == part for o, part in zip(own, parts, strict=True))
        return named if same and all(named.values()) else None


def _nothing(name: str) -> "Page | None":
    del name
    return None


def _unseen(seen: Seen) -> None:
    del seen


@dataclass(frozen=True)
class Page:
    """A page, and the pages under it.

    Args:
        folder: of its static files in ``studio/pages``; empty where it has none.
        routes: what else it answers.
        under: the page under the first part of a path, None where there is none: what it has at ``/icon.svg`` is
            found at ``/PART/icon.svg``. It may raise a ``DnnvssError``.
        around: what is there while the page is served: entered before the first request, left behind the last.
        seen: is told of every request that is over.
        shared: a folder of static files that it has in common with other pages; empty for none.
    """

    folder: str
    routes: tuple[Route, ...]
    under: "Callable[[str], Page | None]" = _nothing
    around: Callable[[], AbstractAsyncContextManager[Any]] = nullcontext
    seen: Callable[[Seen], None] = _unseen
    shared: str = ""

    def static(self) -> dict[str, Content]:
        """Static files by path; ``/`` is ``index.html``, and all pages have one palette.

        No other file of the package or the disk is among them.
        """
        return _static(self.folder, self.shared) if self.folder else {}

    def within(self, parts: list[str]) -> "tuple[Page, list[str]]":
        """The page that a path leads to, and what of the path is left to it.

        Args:
            parts: of the path between its slashes, decoded.
        """
        inner = self.under(parts[0]) if len(parts) > 1 and parts[0] else None
        return (self, parts) if inner is None else inner.within(parts[1:])


@cache
def _static(*folders: str) -> dict[str, Content]:
    found = {f"/{PALETTE}": Content(style(PALETTE).encode(), _KINDS[".css"])}
    for folder in filter(None, folders):
        for file in package_files(__package__).joinpath("pages", folder).iterdir():
            if kind := _KINDS.get(PurePath(file.name).suffix):
                found[f"/{file.name}"] = Content(file.read_bytes(), kind)
    return {"/": found["/index.html"], **found}
