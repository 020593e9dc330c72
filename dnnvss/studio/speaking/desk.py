"""What the page and the service do: runs, takes, uploads, and the routes to them."""

import json
import platform
import tempfile
import threading
from collections import OrderedDict
from collections.abc import Iterator, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from dnnvss import __version__
from dnnvss.errors import DnnvssError
from dnnvss.records import as_record
from dnnvss.runs.choice import finished_runs
from dnnvss.runs.run import Run
from dnnvss.studio.page import STREAM, Asked, Content, Page, Route
from dnnvss.studio.speaking.openapi import described
from dnnvss.studio.speaking.saying import Change, Saying
from dnnvss.studio.speaking.setup import Setup
from dnnvss.studio.speaking.takes import Shelf, Take
from dnnvss.studio.speaking.uploads import Uploads
from dnnvss.studio.speaking.work import Work
from dnnvss.style.generator import StyleSettings
from dnnvss.synthesis.speak import speak, speak_again

MOST_SENT = 60_000_000
"""Bytes of a sound that is brought."""
_OPEN = 3
"""Runs that are held open."""


class SpeakingDesk:
    """What is behind the page: everything that is kept lies here, and is gone with it.

    Args:
        runs: a folder of run folders, or a run.
        styles: the styles by name.
        work: bounds on what is done at once.
    """

    def __init__(self, runs: Path, styles: Mapping[str, StyleSettings], work: Work | None = None) -> None:
        self._runs, self._styles, self._work = runs, styles, work or Work()
        self._opened: OrderedDict[str, Run] = OrderedDict()
        self._lock, self._drawing = threading.Lock(), threading.Lock()
        self._shelf, self._uploads, self._setup = Shelf(), Uploads(), Setup(runs)
        self._folder = tempfile.TemporaryDirectory(prefix="dnnvss-studio-")

    def page(self) -> Page:
        """The page to serve, with the service under it."""
        routes = (
            Route("GET", "/v1/runs", lambda asked: self.runs(), "the finished runs, the last one first"),
            Route("POST", "/v1/speak", lambda asked: self.speak(asked.body), "says something; answers with a take"),
            Route("POST", "/v1/takes/{take}", lambda asked: self.change(asked.names["take"], asked.body),
                  "the same words at the same times in another style or with keys; answers with a new take"),
            Route("GET", "/v1/takes/{take}", lambda asked: self._shelf.get(asked.names["take"]).described(),
                  "all about a take but its pictures and its sound"),
            Route("GET", "/v1/takes/{take}/pictures", self.pictures,
                  "pictures first=K count=N view=face as JPEG, each behind its length in four bytes"),
            Route("GET", "/v1/takes/{take}/sound", self.sound, "the sound as 16-bit WAV"),
            Route("GET", "/v1/takes/{take}/files/{file}", self.file, "a file to take away; the take names them"),
            Route(STREAM, "/v1/stream", lambda asked: self.stream(asked.body), "says something, as speak; a WebSocket: "
                  "first the take as JSON, then each picture as JPEG behind its number in four bytes"),
            Route("POST", "/v1/sounds", lambda asked: self._uploads.sound(asked.body),
                  "a recording in any common format; answers with its id", MOST_SENT),
            Route("POST", "/v1/alignments/{file}",
                  lambda asked: self._uploads.alignment(asked.names["file"], asked.body),
                  "phone times out of a TextGrid or .lab, as speak takes them", 5_000_000),
            Route("GET", "/v1/setup", lambda asked: self._setup.state(), "how far the built-in talker is"),
            Route("POST", "/v1/setup", lambda asked: self._setup.start(), "makes the built-in talker"),
            Route("GET", "/v1/health", lambda asked: self.health(), "whether the service is well"),
            Route("GET", "/v1/metrics", lambda asked: Content(self._work.told().encode(), "text/plain; version=0.0.4"),
                  "counts and seconds in the text form of Prometheus"),
            Route("GET", "/v1/openapi.json", lambda asked: described(self.page().routes), "this description"),
        )
        return Page("speaking", routes)

    def close(self) -> None:
        """Forget everything."""
        self._setup.end()
        self._folder.cleanup()

    def runs(self) -> dict[str, Any]:
        """The runs by name, what drives each, and the styles; none where nothing was trained yet."""
        try:
            found = finished_runs(self._runs)
        except DnnvssError as error:
            return {"runs": [], "styles": list(self._styles), "why": str(error)}
        runs = [{"name": c.folder.name, "title": c.title, "correlation": round(c.headline, 3),
                 "face": str(c.settings.face["kind"]), "listens": "sound" in c.needs,
                 "reads": bool(c.needs & {"phones", "words"})} for c in found]
        return {"runs": runs, "styles": list(self._styles), "why": ""}

    def health(self) -> dict[str, Any]:
        """That it answers, its version, and how much it keeps."""
        return {"well": True, "version": __version__, "python": platform.python_version(), "takes": len(self._shelf),
                "inside": self._work.inside}

    def speak(self, body: Any) -> dict[str, Any]:
        """Say something and keep it as a take."""
        saying = as_record(Saying, body, "the request", "GET /v1/openapi.json describes it")
        with self._work.task("speak"):
            run = self._run(saying.run)
            recording = self._uploads.get(saying.sound) if saying.sound else None
            return self._kept(Take(saying, speak(run, saying.request(run.face, self._styles, recording))))

    def change(self, name: str, body: Any) -> dict[str, Any]:
        """Say a take again in another style or with other keys."""
        take = self._shelf.get(name)
        change = as_record(Change, body, "the request", "GET /v1/openapi.json describes it")
        own = {key: getattr(change, key) for key in asdict(change)}
        saying = replace(take.saying, **own)
        with self._work.task("change"):
            spoken = take.spoken
            request = saying.request(spoken.run.face, self._styles, spoken.request.recording)
            return self._kept(Take(saying, speak_again(spoken, request)))

    def pictures(self, asked: Asked) -> Content:
        """A few pictures of a take."""
        take = self._shelf.get(asked.names["take"])
        first, count = (_whole(asked.query, name, default) for name, default in (("first", 0), ("count", 8)))
        with self._work.task("pictures"):
            return Content(take.pictures(first, count, asked.query.get("view")), "application/octet-stream")

    def stream(self, body: Any) -> Iterator[str | bytes]:
        """Say something; yield the take as JSON, then its pictures one by one."""
        told = self.speak(body)
        yield json.dumps(told, allow_nan=False)
        take = self._shelf.get(told["id"])
        for frame in range(take.frames):
            with self._work.task("pictures"):
                picture = take.pictures(frame, 1)
            yield frame.to_bytes(4, "little") + picture[4:]

    def sound(self, asked: Asked) -> Content:
        """The sound of a take."""
        if (sound := self._shelf.get(asked.names["take"]).sound) is None:
            raise DnnvssError("nothing is heard in this take", remedy="Say it with an engine or a recording")
        return Content(sound, "audio/wav")

    def file(self, asked: Asked) -> Path:
        """A file of a take, made when it is first asked for."""
        take = self._shelf.get(asked.names["take"])
        with self._work.task("file"), self._drawing:
            return take.file(asked.names["file"], Path(self._folder.name) / take.id)

    def _kept(self, take: Take) -> dict[str, Any]:
        for old in self._shelf.put(take):
            folder = Path(self._folder.name) / old.id
            for path in folder.glob("*"):
                path.unlink(missing_ok=True)
        return take.described()

    def _run(self, name: str) -> Run:
        """A run by its name, held open."""
        with self._lock:
            if name not in self._opened:
                folders = {c.folder.name: c.folder for c in finished_runs(self._runs)}
                if name not in folders:
                    raise DnnvssError(f"there is no run {name[:80]!r}", remedy="GET /v1/runs lists them")
                self._opened[name] = Run.open(folders[name])
                while len(self._opened) > _OPEN:
                    self._opened.popitem(last=False)
            self._opened.move_to_end(name)
            return self._opened[name]


def _whole(query: Mapping[str, str], name: str, default: int) -> int:
    value = query.get(name, str(default))
    if not (value.isascii() and value.isdigit() and len(value) < 10):
        raise DnnvssError(f"{name}={value[:20]!r} is no whole number")
    return int(value)
