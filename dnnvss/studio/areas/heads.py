"""Heads: meshes of the user's own whose points are guessed or set by hand."""

from collections.abc import Sequence
from pathlib import Path

from dnnvss.face.mesh.pointing import NAME, HeadPoints, listed
from dnnvss.studio.areas.area import Area, Item, Link
from dnnvss.studio.areas.places import Thing, found
from dnnvss.studio.heads import HeadDesk


def heads(folders: Sequence[Path]) -> Area:
    """The area of the heads in some folders."""
    return Area(
        "heads", "Heads",
        "Points on a mesh of your own, so that a take or what is said here moves it.",
        {"Find the points of a mesh": "dnnvss points mine.obj --out heads/mine"},
        lambda: found(folders, (NAME,)), _item, lambda thing: HeadDesk(thing.folder).page())


def _item(thing: Thing) -> Item:
    points = HeadPoints.open(thing.folder)
    facts = {"mesh": points.path.name, "points": f"{len(points.points)} of {len(listed())}",
             "set by hand": str(len(points.placed))}
    return Item(thing.name, thing.name, str(thing.folder), facts, (Link("Set the points", ""),),
                "complete" if len(points.points) == len(listed()) else "open")
