"""Labelling: folders of frames whose points are dragged."""

from collections.abc import Sequence
from pathlib import Path

from dnnvss.face.aam.labelling.sheet import NAME, Sheet
from dnnvss.studio.areas.area import Area, Item, Link
from dnnvss.studio.areas.places import Thing, found
from dnnvss.studio.labelling import LabelDesk


def labels(folders: Sequence[Path]) -> Area:
    """The area of the labels in some folders."""
    return Area(
        "labelling", "Labelling",
        "Points dragged on thirty frames teach a model that finds them in all others.",
        {"Choose frames to label": "dnnvss label choose VIDEOS --count 30 --out labels"},
        lambda: found(folders, (NAME,)), _item, lambda thing: LabelDesk(thing.folder).page())


def _item(thing: Thing) -> Item:
    sheet = Sheet.open(thing.folder)
    facts = {"frames": f"{len(sheet.done)} of {len(sheet.labels)} finished", "points": f"{sheet.count}, {sheet.scheme}"}
    return Item(thing.name, thing.name, str(thing.folder), facts, (Link("Drag the points", ""),),
                "finished" if len(sheet.done) == len(sheet.labels) else "open")
