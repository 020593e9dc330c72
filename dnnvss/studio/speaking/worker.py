"""A worker of the service: a process that says, draws and writes, one thing after the other.

    python -m dnnvss.studio.speaking.worker

It reads messages (:mod:`~dnnvss.studio.wire`) and answers each; the first one says where things lie. It ends
with its input.
"""

import json
import os
import signal
import sys
import traceback
from collections import OrderedDict
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from dnnvss.errors import DnnvssError
from dnnvss.processes import end_with_parent
from dnnvss.records import as_record
from dnnvss.runs.choice import finished_runs
from dnnvss.runs.run import Run
from dnnvss.shortages import shortage_of
from dnnvss.studio.page import Content
from dnnvss.studio.speaking.latest import Latest
from dnnvss.studio.speaking.saying import Saying
from dnnvss.studio.speaking.takes import Take
from dnnvss.studio.speaking.uploads import read_sound
from dnnvss.studio.wire import framed, read_frame
from dnnvss.style.generator import StyleSettings
from dnnvss.synthesis.speak import speak, speak_again

_OPEN = 3
"""Runs that are held open."""
_KEPT = 150, 2e8
"""Takes that are kept, and bytes that they may hold together."""


class Speaker:
    """What a worker does. A take that it does not keep is said again: the same saying gives the same take.

    Args:
        runs: a folder of run folders, or a run.
        styles: by name.
        folder: files of takes lie in it, each take's in a folder of its own.
    """

    def __init__(self, runs: Path, styles: Mapping[str, StyleSettings], folder: Path) -> None:
        self._runs, self._styles, self._folder = runs, styles, folder
        self._opened, self._takes = OrderedDict[str, Run](), Latest[Take](*_KEPT)

    def warm(self) -> None:
        """Open the run that is asked for first, and say a word with it: what that reads is read once."""
        with suppress(DnnvssError):
            saying = Saying(run=finished_runs(self._runs)[0].folder.name, text="a")
            run = self._run(saying.run)
            Take(saying, speak(run, saying.request(run.face, self._styles, None)), "").pictures(
                0, 1
            )

    def do(self, job: Mapping[str, Any]) -> tuple[dict[str, Any], Content]:
        """What a job asks for, and the number of pictures of the take."""
        take = self._take(job)
        match job["job"]:
            case "pictures":
                pictures = take.pictures(job["first"], job["count"], job["view"])
                made = Content(pictures, "application/octet-stream")
            case "sound":
                made = Content(take.sound_or_error(), "audio/wav")
            case "file":
                take.file(job["file"], self._folder / take.id)
                made = Content(b"", "")
            case _:
                made = Content(
                    json.dumps(take.described(), allow_nan=False).encode(), "application/json"
                )
        return {"kind": made.kind, "frames": take.frames}, made

    def _take(self, job: Mapping[str, Any]) -> Take:
        """The take of a job, said again where it is not kept."""
        if (known := self._takes.get(job["take"])) is not None:
            return known
        saying = as_record(
            Saying, job["saying"], "the request", "GET /v1/openapi.json describes it"
        )
        like = self._takes.get(job.get("like") or "")
        if like is not None:
            spoken = like.spoken
            request = saying.request(spoken.run.face, self._styles, spoken.request.recording)
            take = Take(saying, speak_again(spoken, request), job["take"])
        else:
            run, sound = self._run(saying.run), job.get("sound")
            recording = read_sound(Path(sound)) if sound else None
            take = Take(
                saying, speak(run, saying.request(run.face, self._styles, recording)), job["take"]
            )
        self._takes.put(take.id, take, take.size)
        return take

    def _run(self, name: str) -> Run:
        """A run by its name, held open."""
        if name not in self._opened:
            folders = {c.folder.name: c.folder for c in finished_runs(self._runs)}
            if name not in folders:
                raise DnnvssError(
                    f"there is no run {name[:80]!r}", remedy="GET /v1/runs lists them"
                )
            self._opened[name] = Run.open(folders[name])
            while len(self._opened) > _OPEN:
                self._opened.popitem(last=False)
        self._opened.move_to_end(name)
        return self._opened[name]


def answered(speaker: Speaker, job: Mapping[str, Any]) -> bytes:
    """The message that answers a job."""
    try:
        head, made = speaker.do(job)
        return framed(head, made.body)
    except Exception as error:
        short = shortage_of(error)
        if short is None and not isinstance(error, DnnvssError):
            traceback.print_exc()
            return framed({"failed": type(error).__name__})
        told = short or error
        assert isinstance(told, DnnvssError)
        file = None if told.file is None else str(told.file)
        return framed(
            {
                "short": short is not None,
                "wrong": {
                    "problem": told.problem,
                    "file": file,
                    "utterance": told.utterance,
                    "remedy": told.remedy,
                },
            }
        )


def main() -> None:
    """Answer jobs until there are none."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the service ends it
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print is no message
    begun = read_frame(sys.stdin.buffer)
    if begun is None:
        return
    greeting = begun[0]
    end_with_parent(greeting["parent"])
    styles = {
        name: as_record(StyleSettings, own, "the style", "")
        for name, own in greeting["styles"].items()
    }
    speaker = Speaker(Path(greeting["runs"]), styles, Path(greeting["folder"]))
    speaker.warm()
    frame = framed({"ready": True})
    while True:
        out.write(frame)
        out.flush()
        given = read_frame(sys.stdin.buffer)
        if given is None:
            return
        frame = answered(speaker, given[0])


if __name__ == "__main__":
    main()
