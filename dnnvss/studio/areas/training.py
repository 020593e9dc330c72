"""Training: the runs of a folder while they learn and afterwards, with curves and sample sentences as they come."""

import time
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from dnnvss.errors import DnnvssError
from dnnvss.runs.files import RunFiles
from dnnvss.runs.talkers import is_together
from dnnvss.staging import abandoned
from dnnvss.studio.areas.area import Area, Item, Link
from dnnvss.studio.areas.curves import FitCurves
from dnnvss.studio.areas.documents import documents, there
from dnnvss.studio.areas.places import Thing, found
from dnnvss.studio.page import Asked, Content, Page, Route

RUNNING, STOPPED, FINISHED = "running", "stopped", "finished"
"""What a run does now."""
_MARK = "run.json"
_SHOWN = ("sample.mp4", "videos/*.mp4")


def training(runs: Sequence[Path]) -> Area:
    """The area of the runs in some folders."""
    return Area(
        "training", "Training", "Runs while they learn: curves, and a sample sentence every few epochs.",
        {"Train on a corpus": "dnnvss train corpus=NAME", "Train on the built-in talker": "dnnvss train corpus=demo"},
        lambda: latest(found(runs, (_MARK,))), _item, _page)


def latest(runs: Sequence[Thing]) -> list[Thing]:
    """Runs, the one that was begun last first."""
    return sorted(runs, key=lambda thing: RunFiles(thing.folder).provenance.stat().st_mtime, reverse=True)


def state_of(folder: Path) -> tuple[str, str]:
    """What a run does now, and how far it is.

    Args:
        folder: of the run.
    """
    places = RunFiles(folder)
    if places.finished:
        return FINISHED, "evaluated"
    far = "fitted, being evaluated" if places.model.is_file() else "being fitted"
    if any(lock.is_file() and not abandoned(lock) for lock in (_lock(folder), _lock(_training(folder)))):
        return RUNNING, far
    return STOPPED, f"it ended while {far.removeprefix('fitted, ')}; the same command goes on from there"


def _training(folder: Path) -> Path:
    """Where the fit of a run lies: in its own folder, or in that of several talkers' training."""
    return folder.parent if is_together(folder.parent) else folder


def _lock(folder: Path) -> Path:
    return folder.parent / f".{folder.name}.lock"


def _item(thing: Thing) -> Item:
    state, far = state_of(thing.folder)
    begun = datetime.fromtimestamp(RunFiles(thing.folder).provenance.stat().st_mtime)
    facts = {"begun": f"{begun:%Y-%m-%d %H:%M}", "state": far}
    films = tuple(Link("A test sentence", name, "film") for name in there(thing.folder, _SHOWN[:1]))
    return Item(thing.name, thing.name, str(thing.folder), facts, (Link("Curves", "fits", "fit"), *films), state)


def _page(thing: Thing) -> Page:
    """Curves and pictures of a run."""
    curves = FitCurves(_training(thing.folder))
    return Page("", (Route("GET", "/fits", lambda asked: _told(thing.folder, curves)),
                     Route("GET", "/picture", lambda asked: _picture(curves, asked)),
                     *documents(thing.folder, _SHOWN).routes))


def _told(folder: Path, curves: FitCurves) -> dict[str, Any]:
    """What the page shows of a run, and asks for again while it runs."""
    state, far = state_of(folder)
    fits = [{**fit, "ago": max(0.0, time.time() - fit.pop("last"))} for fit in curves.fits()]
    return {"state": state, "far": far, "epochs": _epochs(folder), "fits": fits}


def _epochs(folder: Path) -> int | None:
    """The epochs that a fit of the run has at most, where its settings can be read."""
    from dnnvss.runs.settings import RunSettings

    try:
        most = RunSettings.load(folder).trainer.get("epochs")
    except DnnvssError:
        return None
    return most if isinstance(most, int) else None


def _picture(curves: FitCurves, asked: Asked) -> Content:
    step = asked.query.get("step", "")
    if not (step.isascii() and step.isdigit() and len(step) < 12):
        raise DnnvssError(f"step={step[:20]!r} is no whole number")
    return Content(curves.picture(asked.query.get("fit", ""), int(step)), "image/png")
