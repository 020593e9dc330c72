"""The page on which points are dragged."""

import shlex
import threading
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.face.aam.labelling.doubts import doubts
from dnnvss.face.aam.labelling.schemes import SCHEMES
from dnnvss.face.aam.labelling.sheet import Sheet
from dnnvss.face.aam.labelling.suggest import suggest
from dnnvss.studio.page import Page, Route


def next_command(sheet: Sheet) -> str:
    """What to type once every label is finished."""
    return f"dnnvss track {shlex.quote(str(sheet.folder))} {shlex.quote(sheet.videos or 'VIDEOS')}"


class LabelDesk:
    """What the page does with the labels in a folder.

    ``choose`` and ``import`` may change the folder while the page is open: the sheet is read whenever it is needed.
    """

    def __init__(self, folder: Path) -> None:
        self.folder, self._lock, self._learning = folder, threading.Lock(), threading.Lock()

    @property
    def sheet(self) -> Sheet:
        """The labels as they are on disk now."""
        return Sheet.open(self.folder)

    def page(self) -> Page:
        """The page to serve."""
        return Page("labelling", (
            Route("GET", "/labels", lambda asked: self.overview()),
            Route("GET", "/doubts", lambda asked: [vars(doubt) for doubt in doubts(self.sheet)]),
            Route("GET", "/points/{image}", lambda asked: self.points(asked.names["image"])),
            Route("GET", "/image/{image}", lambda asked: self.picture(asked.names["image"])),
            Route("POST", "/points/{image}", lambda asked: self.store(asked.names["image"], asked.body)),
        ), shared="points")

    def overview(self) -> dict[str, Any]:
        """What the page needs to know: groups, lines, labels and how far they are."""
        sheet = self.sheet
        groups = [{"name": g, "start": a, "stop": b, "closed": sheet.closed[g]} for g, (a, b) in sheet.groups.items()]
        labels = [{"image": each.image, "video": each.video, "frame": each.frame, "done": each.image in sheet.done,
                   "moved": each.image in sheet.moved} for each in sheet.labels]
        known = SCHEMES.get(sheet.scheme)
        layout = known.layout.tolist() if known is not None and known.groups == sheet.groups else None
        return {"folder": str(sheet.folder), "scheme": sheet.scheme, "groups": groups, "labels": labels,
                "layout": layout, "next": next_command(sheet)}

    def points(self, image: str) -> dict[str, Any]:
        """The points of a picture, in pixels, and how they were placed; guesses learn from the finished labels."""
        sheet = self.sheet
        with self._learning:
            guess = suggest(sheet, sheet.label(image))
        return {"points": guess.points.tolist(), "how": guess.how}

    def picture(self, image: str) -> Path:
        """The file of a picture that the sheet names."""
        sheet = self.sheet
        return files.inside(sheet.folder, sheet.label(image).image)

    def store(self, image: str, value: Any) -> dict[str, str]:
        """Write the points that the page sent for a picture, and return its name.

        Raises:
            DnnvssError: they are not as the page sends them.
        """
        try:
            points, done = np.asarray(value["points"], dtype=float), value["done"]
        except (KeyError, OverflowError, TypeError, ValueError) as error:
            raise DnnvssError(f"the page sent {str(value)[:80]!r}", remedy="Load the page again") from error
        if not isinstance(done, bool) or points.ndim != 2:
            raise DnnvssError(f"the page sent {str(value)[:80]!r}", remedy="Load the page again")
        with self._lock:
            self.sheet.write(image, points, done)
        return {"saved": image}
