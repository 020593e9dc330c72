"""The page on which the points of a head are set on another mesh."""

import shlex
import threading
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.mesh import packaged_head
from dnnvss.face.mesh.guess import faults, turned
from dnnvss.face.mesh.net import packaged_net
from dnnvss.face.mesh.pointing import POINTS, HeadPoints, listed, straightened
from dnnvss.face.mesh.surface import Mesh
from dnnvss.face.mesh.transfer import find_points
from dnnvss.render.head_points import COLOURS, VIEWS, View, group_of
from dnnvss.studio.page import Asked, Content, Page, Route

_HEIGHT, _REMEMBERED = 900, 100
"""Pixels of a view, and the changes that can be taken back."""


def next_command(points: HeadPoints) -> str:
    """What to type once the points are right."""
    given = " ".join(shlex.quote(str(p)) for p in (points.path, "--points", points.folder / POINTS))
    return f"dnnvss rig TAKE.csv --out take.mp4 --head {given}"


class HeadDesk:
    """What the page does with the points in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder, self._lock = folder, threading.Lock()
        self._points = HeadPoints.open(folder)
        self._past: list[HeadPoints] = []

    def page(self) -> Page:
        """The page to serve."""
        return Page("heads", (
            Route("GET", "/head", lambda asked: self.overview(), "groups, views and points"),
            Route("GET", "/view/{view}", lambda asked: self.picture(asked.names["view"]), "a view as PNG"),
            Route("GET", "/reference", lambda asked: _png(_reference().picture), "the packaged head as PNG"),
            Route("POST", "/points", self.move, "a point set at a pixel of a view"),
            Route("POST", "/undo", lambda asked: self.undo(), "the last change taken back"),
        ), shared="points")

    @cached_property
    def _mesh(self) -> Mesh:
        return self._points.mesh()

    @cached_property
    def _turn(self) -> np.ndarray:
        return straightened(self._mesh, self._points.points)

    @cached_property
    def _views(self) -> dict[str, View]:
        upright = turned(self._mesh, self._turn)
        return {name: View.of(upright, name, _HEIGHT) for name in VIEWS}

    def overview(self) -> dict[str, Any]:
        """What the page needs to know."""
        with self._lock:
            groups: dict[str, list[str]] = {}
            for name in listed():
                groups.setdefault(group_of(name), []).append(name)
            rest = packaged_net().at(packaged_head().mesh.vertices)[list(listed().values())]
            known = _reference()
            at, _ = known.seen(rest)
            return {"mesh": str(self._points.path), "folder": str(self.folder), "colours": COLOURS,
                    "groups": [{"name": g, "points": p} for g, p in groups.items()],
                    "reference": {"size": known.camera.size, "points": dict(zip(listed(), at.tolist(), strict=True))},
                    "views": [{"name": n, "size": v.camera.size} for n, v in self._views.items()],
                    "next": next_command(self._points), **self._state()}

    def _state(self) -> dict[str, Any]:
        """The points in each view, which were set, and what looks wrong."""
        own = self._points.points
        places = np.array(list(own.values())).reshape(-1, 3) @ self._turn.T
        seen = {}
        for name, view in self._views.items():
            at, faces = view.seen(places)
            seen[name] = {n: [*p, bool(f)] for n, p, f in zip(own, at.round(2).tolist(), faces, strict=True)}
        wrong = faults(find_points(self._mesh, own)) if len(own) == len(listed()) else []
        return {"seen": seen, "placed": self._points.placed, "guessed": self._points.guessed, "faults": wrong,
                "undo": bool(self._past)}

    def picture(self, name: str) -> Content:
        """A view of the mesh.

        Raises:
            DnnvssError: there is none of that name.
        """
        with self._lock:
            return _png(self._view(name).picture)

    def _view(self, name: Any) -> View:
        if name not in self._views:
            raise DnnvssError(f"there is no view {str(name)[:40]!r}", remedy="Load the page again")
        return self._views[name]

    def move(self, asked: Asked) -> dict[str, Any]:
        """Set a point where the page says, and write all.

        Raises:
            DnnvssError: it is not as the page sends it, or nothing of the mesh is seen there.
        """
        sent = asked.body
        if not isinstance(sent, dict) or not isinstance(sent.get("name"), str):
            raise DnnvssError(f"the page sent {str(sent)[:80]!r}", remedy="Load the page again")
        x, y = (_number(sent.get(axis)) for axis in "xy")
        with self._lock:
            place = self._view(sent.get("view")).place(x, y)
            if place is None:
                raise DnnvssError("nothing of the mesh is there", remedy="Set the point on the mesh")
            before = self._points
            made = before.moved(sent["name"], place @ self._turn)
            made.save()
            self._points = made
            self._past = [*self._past[-_REMEMBERED:], before]
            return self._state()

    def undo(self) -> dict[str, Any]:
        """Take the last change back."""
        with self._lock:
            if self._past:
                before = self._past[-1]
                before.save()
                self._points, self._past = before, self._past[:-1]
            return self._state()


def _number(value: Any) -> float:
    if type(value) not in (int, float) or not abs(value) < 1e6:
        raise DnnvssError(f"the page sent {str(value)[:80]!r}", remedy="Load the page again")
    return float(value)


def _reference() -> View:
    return View.of(packaged_head().mesh, "front", 420)


def _png(image: np.ndarray) -> Content:
    done, data = cv2.imencode(".png", image[:, :, ::-1])
    assert done
    return Content(data.tobytes(), "image/png")
