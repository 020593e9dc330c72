"""What the page and the service do: runs, takes, uploads, and the routes to them; the work is done by workers."""

import asyncio
import math
import os
import platform
import sys
from collections.abc import AsyncIterator, Mapping
from contextlib import ExitStack, asynccontextmanager
from dataclasses import asdict, fields, replace
from pathlib import Path
from secrets import token_urlsafe
from typing import Any

from dnnvss import __version__
from dnnvss.errors import DnnvssError
from dnnvss.records import as_record
from dnnvss.runs.choice import finished_runs
from dnnvss.staging import scratch
from dnnvss.studio.page import STREAM, Asked, BusyError, Content, Page, Route
from dnnvss.studio.pool import Done, Pool, PoolLimits
from dnnvss.studio.requests import Requests
from dnnvss.studio.speaking.known import KnownTakes
from dnnvss.studio.speaking.openapi import described
from dnnvss.studio.speaking.saying import Change, Saying
from dnnvss.studio.speaking.setup import Setup
from dnnvss.studio.speaking.uploads import Uploads
from dnnvss.style.generator import StyleSettings

MOST_SENT = 60_000_000
"""Bytes of a sound that is brought."""
_READERS, _BRINGING = 2, 16
"""Processes that read what was brought, and how many may wait for them."""
_STREAMED = 4
"""Pictures of a stream that are drawn at once."""
WORKER = (sys.executable, "-m", "dnnvss.studio.speaking.worker")
"""What starts a worker."""


class SpeakingDesk:
    """What is behind the page: everything that is kept lies here and with its workers, and is gone with it.

    Args:
        runs: a folder of run folders, or a run.
        styles: the styles by name.
        limits: on what is done at once, and for how long.
        requests: counts requests, and writes a log of them.
        worker: starts a worker.
    """

    def __init__(
        self,
        runs: Path,
        styles: Mapping[str, StyleSettings],
        limits: PoolLimits | None = None,
        requests: Requests | None = None,
        worker: tuple[str, ...] = WORKER,
    ) -> None:
        self._runs, self._styles, self._requests = runs, styles, requests or Requests()
        self._temporary = ExitStack()
        folder = self._temporary.enter_context(scratch())
        self._known, self._uploads, self._setup = (
            KnownTakes(folder),
            Uploads(folder / "sounds"),
            Setup(runs),
        )
        greeting = {
            "runs": str(runs.absolute()),
            "styles": {name: asdict(own) for name, own in styles.items()},
            "folder": str(folder),
            "parent": os.getpid(),
        }
        self._pool = Pool(worker, greeting, limits or PoolLimits())
        self._bringing, self._readers = 0, asyncio.Semaphore(_READERS)

    def page(self) -> Page:
        """The page to serve, with the service under it."""
        return Page("speaking", self.routes(), around=self.working, seen=self._requests.seen)

    def routes(self) -> tuple[Route, ...]:
        """The service: what may be asked, and what answers."""
        take = "/v1/takes/{take}"
        return (
            Route("GET", "/v1/runs", lambda asked: self.runs(), "the finished runs, the last one first"),
            Route("POST", "/v1/speak", self.speak, "says something; answers with a take"),
            Route("POST", take, self.change, "the same words at the same times in another style or with keys; answers "
                  "with a new take"),
            Route("GET", take, self.told, "all about a take but its pictures and its sound"),
            Route("GET", f"{take}/pictures", self.pictures, "pictures first=K count=N view=face as JPEG, each behind "
                  "its length in four bytes"),
            Route("GET", f"{take}/sound", self.sound, "the sound as 16-bit WAV"),
            Route("GET", f"{take}/files/{{file}}", self.file, "a file to take away; the take names them"),
            Route(STREAM, "/v1/stream", self.stream, "says something, as speak; a WebSocket: first the take as JSON, "
                  "then each picture as JPEG behind its number in four bytes"),
            Route("POST", "/v1/sounds", self.bring_sound, "a recording in any common format; answers with its id",
                  MOST_SENT),
            Route("POST", "/v1/alignments/{file}", self.bring_times, "phone times out of a TextGrid or .lab, as speak "
                  "takes them", 5_000_000),
            Route("GET", "/v1/setup", lambda asked: self._setup.state(), "how far the built-in talker is"),
            Route("POST", "/v1/setup", lambda asked: self._setup.start(), "makes the built-in talker"),
            Route("GET", "/v1/health", self.health, "whether the service is well; 503 where no worker is there"),
            Route("GET", "/v1/metrics", self.metrics, "counts and seconds in the text form of Prometheus"),
            Route("GET", "/v1/openapi.json", lambda asked: described(self.routes()), "this description"),
        )

    @asynccontextmanager
    async def working(self) -> AsyncIterator[None]:
        """Have the workers in the block."""
        async with self._pool.working():
            yield

    def close(self) -> None:
        """Forget everything."""
        self._setup.end()
        self._requests.close()
        self._temporary.close()

    def runs(self) -> dict[str, Any]:
        """The runs by name, what drives each, and the styles; none where nothing was trained yet."""
        try:
            found = finished_runs(self._runs)
        except DnnvssError as error:
            return {"runs": [], "styles": list(self._styles), "why": str(error)}
        runs = [
            {
                "name": c.folder.name,
                "title": c.title,
                "correlation": None if math.isnan(test := c.headlines.test) else round(test, 3),
                "face": str(c.settings.face["kind"]),
                "listens": "sound" in c.needs,
                "reads": bool(c.needs & {"phones", "words"}),
            }
            for c in found
        ]
        return {"runs": runs, "styles": list(self._styles), "why": ""}

    async def health(self, asked: Asked) -> dict[str, Any]:
        """That it answers, its version, and how much it keeps.

        Raises:
            BusyError: no worker is there: none has begun yet, or they end as they begin.
        """
        if not self._pool.ready:
            raise BusyError("no worker is there yet", remedy="Ask again in a moment").after(3)
        return {
            "well": True,
            "version": __version__,
            "python": platform.python_version(),
            "takes": len(self._known),
            "inside": self._pool.inside,
            "workers": self._pool.ready,
            "replaced": self._pool.counts["replaced"],
        }

    async def metrics(self, asked: Asked) -> Content:
        """Counts and seconds of requests and of work."""
        return Content(
            (self._pool.told() + self._requests.told()).encode(), "text/plain; version=0.0.4"
        )

    async def speak(self, asked: Asked) -> Content:
        """Say something and know it as a take."""
        saying = await asyncio.to_thread(_read, Saying, asked.body)
        return (await self._said(asked, saying))[1]

    async def change(self, asked: Asked) -> Content:
        """Say a take again in another style or with other keys."""
        old = asked.names["take"]
        known = self._known.get(old)
        change = await asyncio.to_thread(_read, Change, asked.body)
        saying = replace(
            known.saying, **{field.name: getattr(change, field.name) for field in fields(Change)}
        )
        return (await self._said(asked, saying, old))[1]

    async def _said(self, asked: Asked, saying: Saying, like: str = "") -> tuple[str, Content, int]:
        """The id of a new take, what is told of it, and the number of its pictures."""
        name, near = token_urlsafe(9), self._known.get(like).worker if like else None
        asked.notes.update({"signs": len(saying.text)} | self._requests.texts(saying.text))
        job = {
            "job": "change" if like else "speak",
            "take": name,
            "saying": asdict(saying),
            "like": like,
        }
        done = await self._done(asked, job | self._heard(saying), near)
        asked.notes["run"] = saying.run  # now that there is one of this name, it is nothing that a user wrote
        self._known.put(name, saying, done.worker)
        return name, Content(done.body, str(done.head["kind"])), int(done.head["frames"])

    def _heard(self, saying: Saying) -> dict[str, str]:
        return {"sound": str(self._uploads.path(saying.sound))} if saying.sound else {}

    async def _done(self, asked: Asked, job: Mapping[str, Any], near: int | None) -> Done:
        done = await self._pool.do(job, near)
        asked.notes.update(
            {"worker": done.worker, "tries": done.tries, "waited": round(done.waited, 4)}
        )
        return done

    async def _of(self, asked: Asked, name: str, job: str, **more: Any) -> Done:
        """What the worker that keeps a take, or else another one, makes of a job about it."""
        known = self._known.get(name)
        about = {
            "job": job,
            "take": name,
            "saying": known.told,
            **self._heard(known.saying),
            **more,
        }
        done = await self._done(asked, about, known.worker)
        known.worker = done.worker
        return done

    async def told(self, asked: Asked) -> Content:
        """All about a take."""
        done = await self._of(asked, asked.names["take"], "told")
        return Content(done.body, str(done.head["kind"]))

    async def pictures(self, asked: Asked) -> Content:
        """A few pictures of a take."""
        first, count = (
            _whole(asked.query, name, default) for name, default in (("first", 0), ("count", 8))
        )
        done = await self._of(
            asked,
            asked.names["take"],
            "pictures",
            first=first,
            count=count,
            view=asked.query.get("view"),
        )
        return Content(done.body, str(done.head["kind"]))

    async def stream(self, asked: Asked) -> AsyncIterator[str | bytes]:
        """Say something; yield the take as JSON, then its pictures one by one."""
        saying = await asyncio.to_thread(_read, Saying, asked.body)
        name, told, frames = await self._said(asked, saying)
        yield told.body.decode()
        for first in range(0, frames, _STREAMED):
            count = min(_STREAMED, frames - first)
            done = await self._of(asked, name, "pictures", first=first, count=count, view=None)
            for number, picture in enumerate(split(done.body), first):
                yield number.to_bytes(4, "little") + picture

    async def sound(self, asked: Asked) -> Content:
        """The sound of a take."""
        done = await self._of(asked, asked.names["take"], "sound")
        return Content(done.body, str(done.head["kind"]))

    async def file(self, asked: Asked) -> Path:
        """A file of a take, made when it is first asked for."""
        name, file = asked.names["take"], asked.names["file"]
        await self._of(
            asked, name, "file", file=file
        )  # refuses a name that is none of the take's files
        return await asyncio.to_thread(self._known.file, name, file)

    async def bring_sound(self, asked: Asked) -> dict[str, Any]:
        """Keep a sound."""
        async with self._reading():
            return await self._uploads.sound(asked.body)

    async def bring_times(self, asked: Asked) -> Any:
        """Phone times out of a file."""
        async with self._reading():
            return await self._uploads.alignment(asked.names["file"], asked.body)

    @asynccontextmanager
    async def _reading(self) -> AsyncIterator[None]:
        """Read what was brought in the block, when it is its turn."""
        if self._bringing >= _READERS + _BRINGING:
            raise BusyError(
                "too many are bringing something", remedy="Bring it again in a moment"
            ).after(5)
        self._bringing += 1
        try:
            async with self._readers:
                yield
        finally:
            self._bringing -= 1


def split(pictures: bytes) -> list[bytes]:
    """Pictures that stand one after the other, each behind its length."""
    found, at = list[bytes](), 0
    while at < len(pictures):
        end = at + 4 + int.from_bytes(pictures[at : at + 4], "little")
        found.append(pictures[at + 4 : end])
        at = end
    return found


def _read(kind: type, body: Any) -> Any:
    return as_record(kind, body, "the request", None)


def _whole(query: Mapping[str, str], name: str, default: int) -> int:
    value = query.get(name, str(default))
    if not (value.isascii() and value.isdigit() and len(value) < 10):
        raise DnnvssError(f"{name}={value[:20]!r} is no whole number")
    return int(value)
