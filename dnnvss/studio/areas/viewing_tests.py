"""Viewing tests: the page that viewers see, and what they answered."""

from collections.abc import Sequence
from pathlib import Path

from dnnvss.evaluation.viewing.sheet import ANSWERS, KEY, Sheet
from dnnvss.studio.areas.area import Area, Item, Link
from dnnvss.studio.areas.documents import document, there
from dnnvss.studio.areas.places import Thing, found
from dnnvss.studio.page import Page, Route
from dnnvss.studio.viewing import ViewingDesk

REPORT = "viewing.html"


def viewing(folders: Sequence[Path]) -> Area:
    """The area of the viewing tests in some folders."""
    return Area(
        "viewing", "Viewing tests",
        "What people see, not only what correlates. Whoever opens a test here is a viewer, and the answers count.",
        {"Make a test of two runs": "dnnvss viewing make preference RUN RUN --out viewing",
         "Let others in to see it": "dnnvss viewing serve viewing --host 0.0.0.0",
         "Conclude from the answers": "dnnvss viewing analyse viewing/answers"},
        lambda: found(folders, (KEY,)), _item, _page)


def _item(thing: Thing) -> Item:
    sheet = Sheet.open(thing.folder)
    answers = sum(1 for _ in (thing.folder / ANSWERS).glob("*.json"))
    facts = {"kind": str(sheet.design["kind"]), "answers": str(answers),
             "lists": f"{len(sheet.lists)} of {len(sheet.lists[0])} trials"}
    links = (Link("The test", ""), *(Link("Result", name) for name in there(thing.folder, (REPORT,))))
    return Item(thing.name, str(sheet.design["title"]), str(thing.folder), facts, links,
                "analysed" if len(links) > 1 else "open")


def _page(thing: Thing) -> Page:
    """The page of the test, and its result beside it."""
    own = ViewingDesk(thing.folder).page()
    result = Route("GET", f"/{REPORT}", lambda asked: document(thing.folder, REPORT, (REPORT,)))
    return Page(own.folder, (*own.routes, result))
