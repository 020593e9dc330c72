"""Guesses that learn: where an unfinished label's points lie by a search model of the labels finished so far."""

import hashlib
from functools import lru_cache
from pathlib import Path

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.aam.labelling.guess import Guess
from dnnvss.face.aam.labelling.sheet import Label, Sheet
from dnnvss.face.aam.search.find import search
from dnnvss.face.aam.search.fit import fit_search
from dnnvss.face.aam.search.model import SearchModel

FROM = 6
"""Finished labels from which there is a model."""

FIRST = "first guess"
"""How the points were placed where no model of the labels betters them."""


def suggest(sheet: Sheet, label: Label) -> Guess:
    """The points to start a label from.

    What a person has moved or finished stays as it is. Else the points are searched by a model of the finished labels,
    from the label's first guess, and from its surroundings where that leads nowhere; the first guess is given where the
    model does not explain the picture.

    Raises:
        DnnvssError: the label's points or picture cannot be read.
    """
    points = sheet.read(label)
    finished = [each for each in sheet.labels if each.image in sheet.done]
    if label.image in sheet.done | sheet.moved:
        return Guess(points, "moved by hand")
    if len(finished) < FROM:
        return Guess(points, FIRST)
    picture = sheet.picture(label)
    try:
        model = _model(sheet.folder, tuple(each.image for each in finished), _state(sheet, finished))
    except DnnvssError:  # points on one line or outside their picture: what looks wrong is listed on the page
        return Guess(points, FIRST)
    for wide in (False, True):
        found = search(model, picture, model.shapes.nearest(points) if not wide else points, wide)
        if found.error <= model.limits.error and not found.outside and np.isfinite(found.points).all():
            return Guess(found.points.astype(float), f"{len(finished)} finished labels")
    return Guess(points, FIRST)


def _state(sheet: Sheet, finished: list[Label]) -> str:
    """A hash of the finished points: a model belongs to them."""
    points = [sheet.read(each).tobytes() for each in finished]
    return hashlib.sha256(b"".join(points)).hexdigest()


@lru_cache(maxsize=1)
def _model(folder: Path, images: tuple[str, ...], state: str) -> SearchModel:
    del state  # what it is called with again is the same model
    sheet = Sheet.open(folder)
    labels = [sheet.label(image) for image in images]
    return fit_search([sheet.picture(each) for each in labels], np.stack([sheet.read(each) for each in labels]))

