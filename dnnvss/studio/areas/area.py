"""One area of the studio: what there is, how to begin where there is nothing, and the page of each thing."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from dnnvss.errors import DnnvssError
from dnnvss.studio.areas.places import Thing
from dnnvss.studio.page import Page, Route

OPEN = 16
"""Things of an area that are held open."""


@dataclass(frozen=True)
class Link:
    """Something of a thing that can be looked at.

    Args:
        title: what it is.
        path: under the thing's own.
        kind: ``page`` in a frame, ``text`` in Markdown, ``film``, ``fit``.
    """

    title: str
    path: str
    kind: str = "page"


@dataclass(frozen=True)
class Item:
    """A thing as its area lists it.

    Args:
        name: in addresses.
        title: what a person calls it.
        folder: where it is.
        facts: what is known of it, by what it is.
        links: what can be looked at.
        state: in a word or two.
        wrong: why it cannot be read, where it cannot.
    """

    name: str
    title: str
    folder: str
    facts: Mapping[str, str] = field(default_factory=dict)
    links: tuple[Link, ...] = ()
    state: str = ""
    wrong: str = ""


@dataclass(frozen=True)
class Area:
    """An area of the studio.

    Args:
        name: in addresses.
        title: in the navigation.
        about: what it is for, in a sentence or two.
        begin: commands that make something for it, by what they do.
        things: what there is now.
        item: how one of them is listed; may raise a ``DnnvssError``.
        page: the page of one of them; may raise a ``DnnvssError``.
    """

    name: str
    title: str
    about: str
    begin: Mapping[str, str]
    things: Callable[[], Iterable[Thing]]
    item: Callable[[Thing], Item]
    page: Callable[[Thing], Page]


class AreaDesk:
    """What is behind the page of an area: every thing's page is made once and held open.

    Args:
        area: of the studio.
        roots: the folders that are looked into, as they are told.
    """

    def __init__(self, area: Area, roots: Iterable[Path]) -> None:
        self.area, self._roots = area, [str(root.resolve()) for root in roots]
        self._known = dict[str, Thing]()
        self._pages, self._lock = OrderedDict[Path, Page](), threading.Lock()

    def page(self) -> Page:
        """The page that lists what there is, with that of each thing under it."""
        return Page("areas", (Route("GET", "/items", lambda asked: self.listed(), "what there is"),), self.under)

    def listed(self) -> dict[str, Any]:
        """What the page shows."""
        area = self.area
        begin = [{"about": about, "command": command} for about, command in area.begin.items()]
        return {"title": area.title, "about": area.about, "begin": begin, "folders": self._roots,
                "items": [asdict(self._item(thing)) for thing in area.things()]}

    def under(self, name: str) -> Page:
        """The page of a thing.

        Raises:
            DnnvssError: there is none of that name, or it cannot be read.
        """
        thing = self._known.get(name)
        if thing is None or thing.folder.is_symlink() or not thing.folder.is_dir():
            self._known = {each.name: each for each in self.area.things()}
            if (thing := self._known.get(name)) is None:
                raise DnnvssError("it is not there any more", remedy="Load the list again")
        with self._lock:
            if thing.folder not in self._pages:
                self._pages[thing.folder] = self.area.page(thing)
                while len(self._pages) > OPEN:
                    self._pages.popitem(last=False)
            self._pages.move_to_end(thing.folder)
            return self._pages[thing.folder]

    def _item(self, thing: Thing) -> Item:
        try:
            return self.area.item(thing)
        except (DnnvssError, OSError) as error:
            return Item(thing.name, thing.name, str(thing.folder), wrong=str(error))
