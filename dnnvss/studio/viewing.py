"""The pages of viewing tests: as a folder for any host, and as a server that hands out lists and takes answers."""

import json
import logging
import threading
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.viewing.answers import Answer, answer_files, check_answer, receive
from dnnvss.evaluation.viewing.sheet import ANSWERS, PAGE, Sheet
from dnnvss.pages import PALETTE
from dnnvss.records import as_record
from dnnvss.settings import setting
from dnnvss.studio.page import Page, Route

_LOG = logging.getLogger(__name__)
PATIENCE = 3 * 3600.0
"""Seconds for which a list that was handed out counts as seen, though no answer has come."""
_MOST = 10_000
"""Lists that are out at a time."""
MOST_ANSWERS = 10_000
"""Answers that a server takes, those before it counted."""


def write_page(folder: Path) -> Path:
    """Write the files of the page beside the stimuli of a test, and return the one to open."""
    for path, content in Page("viewing", ()).static().items():
        if path not in ("/", f"/{PALETTE}"):  # this page has greys of its own
            with files.replacing(folder / PAGE / path[1:]) as temporary:
                temporary.write_bytes(content.body)
    return folder / PAGE / "index.html"


@dataclass(frozen=True)
class Asking:
    """What a page sends to be given a list."""

    viewer: str = setting()


class ViewingDesk:
    """What the server of a test does: every list is handed out equally often, every answer read strictly.

    Args:
        folder: of the test, as ``dnnvss viewing make`` wrote it. Answers go to ``answers/`` in it.
        most: files of answers from which no more are taken.

    Raises:
        DnnvssError: there is no such test, or stimuli of it are missing.
    """

    def __init__(self, folder: Path, most: int = MOST_ANSWERS) -> None:
        self.folder, self.sheet, self._lock = folder, Sheet.open(folder), threading.Lock()
        videos = [files.inside(folder, f"{PAGE}/stimuli/{s.id}.mp4") for s in self.sheet.stimuli]
        if missing := [path for path in videos if not path.is_file()]:
            raise DnnvssError(f"{len(missing)} of {len(videos)} stimuli are missing", file=missing[0],
                              remedy="Run the command that made the test again: it renders what is missing")
        answers = files.make_folder(files.inside(folder, ANSWERS))
        received = receive(self.sheet, answer_files(answers))
        taken = received.answers
        self._most, self._files = most, len(taken) + len(received.refused)
        self._done = {answer.viewer: answer.list for answer in taken.values()}
        self._out = dict[str, tuple[int, float]]()

    @property
    def count(self) -> int:
        """Answers that have come."""
        return len(self._done)

    def page(self) -> Page:
        """The page to serve."""
        return Page("viewing", (
            Route("GET", "/test.js", lambda asked: files.inside(self.folder, f"{PAGE}/test.js")),
            Route("GET", "/stimuli/{name}", lambda asked: self.stimulus(asked.names["name"])),
            Route("POST", "/place", lambda asked: {"list": self.place(asked.body)}),
            Route("POST", "/answers", lambda asked: {"taken": self.take(asked.body)}),
        ))

    def stimulus(self, name: str) -> Path:
        """The file of a stimulus of the sheet.

        Raises:
            DnnvssError: it is none.
        """
        if name not in {f"{s.id}.mp4" for s in self.sheet.stimuli}:
            raise DnnvssError("there is no such stimulus", remedy="Load the page again")
        return files.inside(self.folder, f"{PAGE}/stimuli/{name}")

    def place(self, body: Any) -> int:
        """The list of a viewer: the same when asked again, else one that has been given out least often.

        Raises:
            DnnvssError: it is no viewer of the page.
        """
        viewer = as_record(Asking, body, "what was sent", "Load the page again").viewer
        if not _known(viewer):
            raise DnnvssError("this viewer has no number that the page gives out", remedy="Load the page again")
        with self._lock:
            now = time.monotonic()
            self._out = {v: (k, t) for v, (k, t) in self._out.items() if now - t < PATIENCE}
            if viewer in self._done:
                return self._done[viewer]
            if viewer in self._out:
                return self._out[viewer][0]
            if len(self._out) >= _MOST:
                raise DnnvssError("too many viewers at a time", remedy="Try again in an hour")
            chosen = least_given(len(self.sheet.lists), self._done, {v: k for v, (k, _) in self._out.items()})
            self._out[viewer] = chosen, now
            return chosen

    def take(self, body: Any) -> str:
        """Keep the answer of a viewer and return its file's name; the same answer again changes nothing.

        Raises:
            DnnvssError: it is not as the page sends it, or another one of this viewer is there.
        """
        answer: Answer = check_answer(self.sheet, body, "what was sent")
        path = self.folder / ANSWERS / f"{answer.viewer}.json"
        with self._lock:
            if path.exists():
                if _kept(path) == _whole(answer):
                    return path.name
                raise DnnvssError("another answer of this viewer is there already",
                                  remedy="Begin anew for another viewer")
            if self._files >= self._most:
                raise DnnvssError("this test takes no more answers",
                                  remedy="Keep the file that the page offers, and tell who made the test")
            self._keep(path, answer)
            self._files += 1
            self._done[answer.viewer] = answer.list
            self._out.pop(answer.viewer, None)
        return path.name

    def _keep(self, path: Path, answer: Answer) -> None:
        """Write an answer; where that fails, who made the test is told why, and the viewer what to do."""
        try:
            files.write_json(path, asdict(answer))
        except DnnvssError as error:
            _LOG.warning("an answer was not kept: %s", error)
            raise DnnvssError("your answers cannot be kept here now",
                              remedy="Save them as a file, and tell who made the test") from error


def _known(viewer: str) -> bool:
    return len(viewer) == 32 and set(viewer) <= set("0123456789abcdef")


def _kept(path: Path) -> Any:
    """What a file of an answer holds, None where it is damaged."""
    try:
        return files.read_json(path)
    except DnnvssError:
        return None


def _whole(answer: Answer) -> Any:
    """An answer as its file has it: lists for tuples."""
    return json.loads(files.json_text(asdict(answer)))


def least_given(count: int, done: Mapping[str, int], out: Mapping[str, int]) -> int:
    """The first of the lists that were answered or handed out least often.

    Args:
        count: of lists.
        done, out: list by viewer.
    """
    given = [0] * count
    for lists in (done, out):
        for number in lists.values():
            given[number] += 1
    return given.index(min(given))
