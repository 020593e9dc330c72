"""The page on which points are dragged, served to this machine alone."""

import json
import threading
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files as package_files
from typing import Any
from urllib.parse import unquote

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.aam.labelling.doubts import doubts
from dnnvss.face.aam.labelling.sheet import Label, Sheet

_PAGE = {"/": ("index.html", "text/html"), "/page.css": ("page.css", "text/css"),
         "/page.js": ("page.js", "text/javascript")}
_MOST = 1_000_000
"""Bytes that a request may have."""


class LabelServer(ThreadingHTTPServer):
    """Serves one sheet on ``127.0.0.1``; ``url`` says where.

    ``choose`` and ``import`` may change the folder while the page is open: the sheet is read whenever it is needed.

    Args:
        sheet: the labels.
        port: 0 takes a free one.
    """

    daemon_threads = True

    def __init__(self, sheet: Sheet, port: int = 0) -> None:
        self.folder, self.lock = sheet.folder, threading.Lock()
        super().__init__(("127.0.0.1", port), _Handler)

    @property
    def sheet(self) -> Sheet:
        """The labels as they are on disk now."""
        return Sheet.open(self.folder)

    @property
    def url(self) -> str:
        """Where the page is."""
        return f"http://127.0.0.1:{self.server_address[1]}/"

    def overview(self) -> dict[str, Any]:
        """Return what the page needs to know: groups, lines, labels and how far they are."""
        sheet = self.sheet
        groups = [{"name": g, "start": a, "stop": b, "closed": sheet.closed[g]} for g, (a, b) in sheet.groups.items()]
        labels = [{"image": each.image, "video": each.video, "frame": each.frame, "done": each.image in sheet.done}
                  for each in sheet.labels]
        return {"folder": str(sheet.folder), "scheme": sheet.scheme, "groups": groups, "labels": labels}

    def store(self, image: str, value: Any) -> dict[str, str]:
        """Write the points that the page sent for a picture, and return its name.

        Raises:
            DnnvssError: they are not as the page sends them.
        """
        try:
            points, done = np.asarray(value["points"], dtype=float), bool(value["done"])
        except (KeyError, TypeError, ValueError) as error:
            raise DnnvssError(f"the page sent {str(value)[:80]!r}", remedy="Load the page again") from error
        with self.lock:
            self.sheet.write(image, points, done)
        return {"saved": image}


class _Handler(BaseHTTPRequestHandler):
    server: LabelServer
    protocol_version = "HTTP/1.1"

    def do_GET(self) -> None:
        path = unquote(self.path.partition("?")[0])
        if path in _PAGE:
            name, kind = _PAGE[path]
            self._send(package_files(__package__).joinpath("pages", "labelling", name).read_bytes(), kind)
            return
        self._answer(lambda: self._read(path))

    def do_POST(self) -> None:
        kind, _, name = unquote(self.path).lstrip("/").partition("/")
        length = int(self.headers.get("Content-Length") or 0)
        body = self.rfile.read(min(length, _MOST))
        if kind != "points" or self.headers.get_content_type() != "application/json" or length > _MOST:
            self._send(b"not found", "text/plain", HTTPStatus.NOT_FOUND)
            return
        self._answer(lambda: self.server.store(name, json.loads(body)))

    def _read(self, path: str) -> Any:
        kind, _, name = path.lstrip("/").partition("/")
        sheet = self.server.sheet
        if kind == "labels":
            return self.server.overview()
        if kind == "doubts":
            return [vars(doubt) for doubt in doubts(sheet)]
        label: Label = sheet.label(name)
        if kind == "points":
            return sheet.read(label).tolist()
        if kind == "image":
            return (sheet.folder / label.image).read_bytes()
        raise DnnvssError(f"there is no {path}")

    def _answer(self, work: Any) -> None:
        """Send what ``work`` returns, or its error; only pages that this server gave out are answered."""
        if self.headers.get("Host") not in {f"{h}:{self.server.server_address[1]}" for h in ("127.0.0.1", "localhost")}:
            self._send(b"this page is for this machine alone", "text/plain", HTTPStatus.FORBIDDEN)
            return
        try:
            value = work()
        except (DnnvssError, OSError, ValueError) as error:
            self._send(json.dumps({"error": str(error)}).encode(), "application/json", HTTPStatus.BAD_REQUEST)
            return
        picture = isinstance(value, bytes)
        self._send(value if picture else json.dumps(value).encode(), "image/png" if picture else "application/json")

    def _send(self, body: bytes, kind: str, status: HTTPStatus = HTTPStatus.OK) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind if kind.startswith("image") else f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """Keep the terminal quiet: the page itself shows what was saved and what went wrong."""
