"""What looks wrong in a sheet: labels that are not finished, and points outside the picture or far from the others'."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.aam.labelling.sheet import Label, Sheet
from dnnvss.face.pose import fit_pose, mean_shape, to_reference

_NEEDED = 5
"""Finished labels from which shapes are compared."""
_SHARE = 0.12
"""Distance from where the others have a point, over the size of the shape, under which nothing is reported."""
_DEVIATIONS = 8.0


@dataclass(frozen=True)
class Doubt:
    """A label that needs a look, and why."""

    image: str
    problem: str


def doubts(sheet: Sheet) -> list[Doubt]:
    """Return what a person should look at again, in the order of the labels."""
    shapes: dict[str, np.ndarray] = {}
    found: list[Doubt] = []
    for label in sheet.labels:
        try:
            points = sheet.read(label)
            height, width = sheet.picture(label).shape[:2]
        except DnnvssError as error:
            found.append(Doubt(label.image, str(error)))
            continue
        if label.image not in sheet.done:
            found.append(Doubt(label.image, "not finished"))
            continue
        shapes[label.image] = points
        found += _single(sheet, label, points, (width, height))
    found += _strangers(sheet, shapes)
    order = {label.image: i for i, label in enumerate(sheet.labels)}
    return sorted(found, key=lambda doubt: order[doubt.image])


def _single(sheet: Sheet, label: Label, points: np.ndarray, size: tuple[int, int]) -> Iterator[Doubt]:
    outside = np.flatnonzero(((points < 0) | (points > size)).any(axis=1))
    if len(outside):
        yield Doubt(label.image, f"{sheet.name_of(int(outside[0]))} lies outside the picture")
    gaps = np.linalg.norm(points[:, None] - points, axis=-1) + 1e9 * np.eye(len(points))
    a, b = np.unravel_index(int(gaps.argmin()), gaps.shape)
    names = sheet.name_of(int(a)).split()[0], sheet.name_of(int(b)).split()[0]
    if gaps[a, b] < 1e-3 and names[0] == names[1]:
        yield Doubt(label.image, f"{sheet.name_of(int(a))} and {sheet.name_of(int(b))} are one point")


def _strangers(sheet: Sheet, shapes: dict[str, np.ndarray]) -> Iterator[Doubt]:
    """Yield the finished labels with a point far from where the others have it, every shape turned onto their mean.

    Far is more than a robust number of deviations of that point, and more than a share of the shape's size. Points that
    all lie in one place have no shape to compare.
    """
    shapes = {image: points for image, points in shapes.items() if np.ptp(points, axis=0).max() > 1e-3}
    if len(shapes) < _NEEDED:
        return
    stack = np.stack(list(shapes.values()))
    mean = mean_shape(stack)
    aligned = to_reference(stack, fit_pose(stack, mean), mean.mean(axis=0))
    away = np.linalg.norm(aligned - np.median(aligned, axis=0), axis=-1)
    usual = np.median(away, axis=0)
    size = np.linalg.norm(np.ptp(mean, axis=0))
    limit = np.maximum(_DEVIATIONS * usual, _SHARE * size)
    for image, distances in zip(shapes, away / limit, strict=True):
        worst = int(distances.argmax())
        if distances[worst] > 1:
            pixels = distances[worst] * limit[worst]
            yield Doubt(image, f"{sheet.name_of(worst)} lies {pixels:.0f} pixels from where the others have it")
