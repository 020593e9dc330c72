"""Results: what finished runs are worth, and comparisons of them."""

from collections.abc import Sequence
from pathlib import Path

from dnnvss.evaluation.cells import number
from dnnvss.runs.files import RunFiles
from dnnvss.runs.headlines import read_headlines
from dnnvss.studio.areas.area import Area, Item, Link
from dnnvss.studio.areas.documents import documents, there
from dnnvss.studio.areas.places import Thing, found
from dnnvss.studio.areas.training import FINISHED, latest
from dnnvss.studio.page import Page

_MARK, _COMPARISON = "metrics.json", "evaluation.html"
_OWN = (Link("Verdict", "verdict.html"), Link("All metrics", "metrics.md", "text"),
        Link("Comparison", "evaluation/evaluation.html"), Link("A test sentence", "sample.mp4", "film"))
_BESIDE = (Link("Comparison", _COMPARISON), Link("Its tables", "evaluation.md", "text"),
           Link("All systems side by side", "side_by_side.mp4", "film"))
_ALLOWED = (*(link.path for link in (*_OWN, *_BESIDE)), "videos/*.mp4")


def results(runs: Sequence[Path], folders: Sequence[Path]) -> Area:
    """The area of the finished runs and of the comparisons in some folders."""
    return Area(
        "results", "Results",
        "The verdict says in five lines what a run is worth; a comparison shows runs beside each other, face by face.",
        {"Train a run, which is judged at its end": "dnnvss train corpus=NAME",
         "Compare runs": "dnnvss compare RUN RUN"},
        lambda: _worth_showing([*runs, *folders]), _item, _page)


def _worth_showing(roots: Sequence[Path]) -> list[Thing]:
    """Finished runs, the latest first, then comparisons: sweeps leave theirs beside their runs."""
    things = found(roots, (_MARK, _COMPARISON))
    runs = [thing for thing in things if there(thing.folder, (_MARK,)) and RunFiles(thing.folder).provenance.is_file()]
    return [*latest(runs), *(t for t in things if t not in runs and there(t.folder, (_COMPARISON,)))]


def _item(thing: Thing) -> Item:
    places = RunFiles(thing.folder)
    if not places.finished:
        links = tuple(link for link in _BESIDE if there(thing.folder, (link.path,)))
        return Item(thing.name, thing.name, str(thing.folder), {}, links, "comparison")
    headlines = read_headlines(places.metrics)
    facts = {"correlation on the test split": number(headlines.test)}
    if headlines.sentences:
        facts["in validation"] = number(headlines.validation)
    films = tuple(Link(f"Sentence {path.stem}", f"videos/{path.name}", "film")
                  for path in sorted((thing.folder / "videos").glob("*.mp4"))[:6])
    own = tuple(link for link in _OWN if there(thing.folder, (link.path,)))
    return Item(thing.name, thing.name, str(thing.folder), facts, (*own, *films), FINISHED)


def _page(thing: Thing) -> Page:
    return documents(thing.folder, _ALLOWED)
