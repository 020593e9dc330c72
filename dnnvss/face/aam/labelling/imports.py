"""Points from the JSON files of LabelMe, COCO keypoints (CVAT, Label Studio and others write it) and VIA."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.face.aam.labelling.sheet import Sheet

Found = dict[str, np.ndarray]
"""File name of a picture to its points (P, 2) in pixels."""
_REMEDY = "Export LabelMe JSON, COCO keypoints (CVAT: format COCO Keypoints 1.0) or VIA JSON"


def read_tool(path: Path, sheet: Sheet) -> Found:
    """Return the points in a tool's JSON file, or in every ``.json`` of a folder (LabelMe writes one a picture).

    - LabelMe: shapes of the type point. Labels are a point's name (``lips_inner 3``, ``lips_inner_3`` or its number
      in all; numbers count from 0, or from 1 where all do), or a group's name for points that follow each other in the
      group's order; a polygon or line of a group's name gives the group's points. Boxes, circles and masks are passed
      over.
    - COCO: ``keypoints`` of an annotation (x, y, visibility), by the names that their category gives them; in the
      order of the scheme where it gives none; numbers count from 0 or 1. One annotation a picture.
    - VIA (1 and 2): regions of the shape point, in their order, or a polyline or polygon named by its attribute.

    Points on a picture of another size than the sheet's are scaled.

    Raises:
        DnnvssError: another kind of file, a picture annotated twice or of another shape, a name that the sheet does not
            have, or points missing; names file and picture.
    """
    if path.is_dir():
        found: Found = {}
        for each in (p for p in sorted(path.glob("*.json")) if p.name != "labels.json"):
            part = read_tool(each, sheet)
            _refuse_twice(sorted(found.keys() & part.keys()), each)
            found |= part
        return found
    value = files.read_json(path, _REMEDY)
    try:
        return _parsed(value, sheet, path)
    except (AttributeError, LookupError, OverflowError, TypeError, ValueError) as error:
        raise DnnvssError(f"is not as its tool writes it ({type(error).__name__}: {error})", file=path,
                          remedy=_REMEDY) from error


def _parsed(value: Any, sheet: Sheet, path: Path) -> Found:
    """What :func:`read_tool` finds in one file."""
    if not isinstance(value, Mapping):
        raise DnnvssError("is no JSON of a labelling tool", file=path, remedy=_REMEDY)
    if "shapes" in value and "imagePath" in value:
        shapes = [(str(s.get("label", "")), s.get("points", [])) for s in value["shapes"]
                  if (s.get("shape_type") or "point") in _POINTED]
        name = _base(value["imagePath"])
        size = value.get("imageWidth"), value.get("imageHeight")
        return {name: _named(shapes, sheet, path, name) * _scale(sheet, path, name, size)}
    if "images" in value and "annotations" in value:
        return _coco(value, sheet, path)
    projects = value.get("_via_img_metadata", value)
    if isinstance(projects, Mapping) and all(isinstance(v, Mapping) and "regions" in v for v in projects.values()):
        rows = [(_base(v["filename"]), v["regions"]) for v in projects.values() if v["regions"]]
        names = [name for name, _ in rows]
        _refuse_twice([name for name in names if names.count(name) > 1], path)
        return {name: _named(_via(regions), sheet, path, name) for name, regions in rows}
    raise DnnvssError("is no JSON of a labelling tool", file=path, remedy=_REMEDY)


def import_into(sheet: Sheet, path: Path) -> tuple[Sheet, list[str]]:
    """Write the points of a tool's file into a sheet, marked finished; return it and the pictures that got points.

    Raises:
        DnnvssError: the file names a picture that the sheet does not have, or wrong points.
    """
    found = {_own(sheet, name): points for name, points in read_tool(path, sheet).items()}
    if not found:
        raise DnnvssError("holds no points", file=path, remedy=_REMEDY)
    known = {label.image for label in sheet.labels}
    if unknown := sorted(set(found) - known):
        raise DnnvssError(f"names the picture {unknown[0]!r}, which {sheet.folder / 'labels.json'} does not",
                          file=path, remedy="Label the pictures that `choose` exported, under their names")
    for name, points in found.items():
        try:
            sheet.checked(points, path)
        except DnnvssError as error:
            raise DnnvssError(f"picture {name}: {error.problem}", file=path,
                              remedy="Label every point of the scheme") from error
        if np.ptp(points, axis=0).max() < _SMALL:
            raise DnnvssError(f"picture {name}: its points lie within {_SMALL} pixels, as shares of a picture do",
                              file=path, remedy="Export them in pixels")
    for name, points in found.items():
        sheet = Sheet.open(sheet.folder).write(name, points, done=True)  # the page may have finished others meanwhile
    return sheet, sorted(found)


_SMALL = 2
"""Pixels within which no face lies."""
_POINTED = ("point", "points", "polygon", "line", "linestrip")
"""Shapes of LabelMe that are points."""
_SHAPE = 0.02
"""Share by which width to height of a picture that was labelled may differ from the sheet's."""


def _scale(sheet: Sheet, path: Path, name: str, size: tuple[Any, Any]) -> np.ndarray:
    """What points (x, y) on a picture of a size are to be multiplied by to lie on the sheet's.

    Raises:
        DnnvssError: the two pictures are not of one shape.
    """
    if not all(type(side) in (int, float) and side > 0 for side in size):
        return np.ones(2)
    label = next((label for label in sheet.labels if label.image == _own(sheet, name)), None)
    picture = None if label is None else cv2.imread(str(sheet.folder / label.image))
    if picture is None:
        return np.ones(2)
    height, width = picture.shape[:2]
    scale = np.array([width / size[0], height / size[1]])
    if abs(scale[0] / scale[1] - 1) > _SHAPE:
        raise DnnvssError(f"picture {name} was labelled at {size[0]} x {size[1]} pixels, and has {width} x {height}",
                          file=path, remedy="Label the pictures that `choose` exported, as they are")
    return scale


def _own(sheet: Sheet, name: str) -> str:
    """The sheet's name of a picture, which a tool may have stored in another format."""
    own = [label.image for label in sheet.labels]
    same = [image for image in own if Path(image).stem == Path(name).stem]
    return name if name in own or len(same) != 1 else same[0]


def _refuse_twice(names: list[str], path: Path) -> None:
    if names:
        raise DnnvssError(f"picture {names[0]} is labelled twice", file=path, remedy="Keep one of its labels")


def _base(name: Any) -> str:
    return str(name).replace("\\", "/").rsplit("/", 1)[-1]


def _coco(value: Mapping[str, Any], sheet: Sheet, path: Path) -> Found:
    names = {image["id"]: _base(image["file_name"]) for image in value["images"]}
    sizes = {image["id"]: (image.get("width"), image.get("height")) for image in value["images"]}
    kinds = {kind.get("id"): kind.get("keypoints") for kind in value.get("categories") or []}
    found: Found = {}
    for row in value["annotations"]:
        if not any(row.get("keypoints") or ()):  # a box alone, which some tools give keypoints of zeros
            continue
        name = names.get(row["image_id"])
        if name is None or name in found:
            raise DnnvssError(f"annotation {row.get('id')} belongs to "
                              f"{'no picture' if name is None else name + ', as another does'}", file=path,
                              remedy="Give one annotation with keypoints a picture")
        if not all(type(v) in (int, float) for v in row["keypoints"]):
            raise ValueError(f"keypoints of picture {name} are not numbers")
        if len(row["keypoints"]) % 3:
            raise DnnvssError(f"picture {name}: {len(row['keypoints'])} numbers are not x, y and visibility of each "
                              "keypoint", file=path, remedy=_REMEDY)
        triples = np.array(row["keypoints"], dtype=float).reshape(-1, 3)
        if (triples[:, 2] == 0).any():
            raise DnnvssError(f"picture {name}: keypoint {int((triples[:, 2] == 0).argmax())} is not labelled",
                              file=path, remedy="Label every point of the scheme")
        points = _ordered(triples[:, :2], kinds.get(row.get("category_id")), sheet, path, name)
        found[name] = points * _scale(sheet, path, name, sizes[row["image_id"]])
    return found


def _ordered(points: np.ndarray, named: Any, sheet: Sheet, path: Path, picture: str) -> np.ndarray:
    """Points (P, 2) in the order of the scheme, by the names that a category gives them."""
    if not named:
        return points
    if len(named) != len(points):
        raise DnnvssError(f"picture {picture}: {len(points)} keypoints, and their category names {len(named)}",
                          file=path, remedy=_REMEDY)
    names = [str(name) for name in named]
    return _named([(name, [point]) for name, point in zip(names, points.tolist(), strict=True)], sheet, path, picture)


def _via(regions: Any) -> list[tuple[str, list[list[float]]]]:
    rows = []
    for region in regions.values() if isinstance(regions, Mapping) else regions:
        shape, attributes = region["shape_attributes"], region.get("region_attributes", {})
        label = next((str(v) for v in attributes.values() if isinstance(v, str) and v), "")
        if shape["name"] == "point":
            rows.append((label, [[shape["cx"], shape["cy"]]]))
        elif "all_points_x" in shape:
            rows.append((label, np.column_stack([shape["all_points_x"], shape["all_points_y"]]).tolist()))
    return rows


def _named(rows: list[tuple[str, list[list[float]]]], sheet: Sheet, path: Path, picture: str) -> np.ndarray:
    """Return points (P, 2) from named rows; unnamed ones follow each other; what is missing is an error."""
    points = np.full((sheet.count, 2), np.nan)
    following = {group: start for group, (start, _) in sheet.groups.items()}
    following[""] = 0
    rows = [(_plain(label), places) for label, places in rows]
    first = _firsts([label for label, _ in rows], sheet)
    for label, places in rows:
        for place in places:
            at = _position(label, following, sheet, first)
            if at is None or not 0 <= at < sheet.count or not np.isnan(points[at]).all():
                raise DnnvssError(f"picture {picture}: point {label!r} is "
                                  f"{'unknown' if at is None else 'one too many'}", file=path,
                                  remedy=f"Name points by group and number; groups: {', '.join(sheet.groups)}")
            if len(place) != 2 or not all(type(v) in (int, float) for v in place):
                raise DnnvssError(f"picture {picture}: point {label!r} is {str(place)[:40]}, not x and y", file=path,
                                  remedy=_REMEDY)
            points[at] = place
    if np.isnan(points).any():
        missing = int(np.isnan(points).any(axis=1).argmax())
        raise DnnvssError(f"picture {picture}: {sheet.name_of(missing)} is missing", file=path,
                          remedy="Label every point of the scheme")
    return points


def _plain(label: str) -> str:
    return label.strip().replace(" ", "_").replace("-", "_").casefold()


def _firsts(labels: list[str], sheet: Sheet) -> dict[str, int]:
    """Group, ``""`` for all points, to the number of its first: 1 where 1 to its size are there, else 0."""
    parts = [("", label) if _is_number(label) else tuple(label.rpartition("_")[::2]) for label in labels]
    sizes = {"": sheet.count, **{group: end - start for group, (start, end) in sheet.groups.items()}}
    return {group: int(sorted(int(n) for g, n in parts if g == group and _is_number(n)) == list(range(1, size + 1)))
            for group, size in sizes.items()}


def _position(label: str, following: dict[str, int], sheet: Sheet, first: Mapping[str, int]) -> int | None:
    if label in following:
        following[label] += 1
        stop = sheet.groups[label][1] if label else sheet.count
        return following[label] - 1 if following[label] <= stop else sheet.count  # beyond all: one too many
    if _is_number(label):
        return int(label) - first[""]
    group, _, number = label.rpartition("_")
    if group not in sheet.groups or not _is_number(number):
        return None
    start, end = sheet.groups[group]
    at = start + int(number) - first[group]
    return at if at < end else sheet.count  # one too many


def _is_number(text: str) -> bool:
    return text.isascii() and text.isdecimal() and len(text) < 10
