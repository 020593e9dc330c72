"""Facial landmarks of a clip: iBUG ``.pts`` and npz, in the plane or in space; OpenFace CSV has its own file.

Coordinates are taken as they stand in the file. Tools differ by half a pixel or one in where they put the origin; the
difference is the same for every point of a corpus, so the appearance model does not see it.
"""

import re
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from difflib import get_close_matches
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.errors import DnnvssError
from dnnvss.formats.numbers import NO_NUMBER, comma_number
from dnnvss.formats.openface import Landmarks, most_frames, read_openface
from dnnvss.records import as_record
from dnnvss.settings import setting
from dnnvss.timing import FrameClock

LAYOUT_68 = {
    "face_oval": (0, 17), "right_brow": (17, 22), "left_brow": (22, 27), "nose_bridge": (27, 31), "nose_base": (31, 36),
    "right_eye": (36, 42), "left_eye": (42, 48), "lips_outer": (48, 60), "lips_inner": (60, 68),
}
"""Groups of the 68-point markup of iBUG 300-W, which OpenFace and dlib follow."""

MESHES = (468, 478)
"""Points of a face mesh without and with irises; trackers give them a depth too, which has no unit."""

_PTS = "Write the file as: version: 1, n_points: N, {, N lines of X Y, }"
_DIGITS = 16  # of a frame number, at which it is none
_SEQUENCE = "Name the files ID_000001.pts and so on, one a frame"
_MARKS = 'Write {"groups": {"lips_outer": [48, 60], ...}, "scale": 1, "rate": 25, "size": [640, 480]} there'
_NPZ = ("Save an array points (frames, points, 2) in pixels, or (frames, points, 3), and, where known, valid (frames,) "
        "and times (frames,) in seconds")
_POINTS, _SPARE = 1000, 1_000_000  # more points than any markup has, and bytes of headers and the like
_OTHERS = {(3, 2): "Save x and y alone, points[..., :2]; for points in space, in mm, set corpus.importer.dim=3",
           (2, 3): "Set corpus.importer.dim=2 for points in the picture"}
"""Coordinates that points have and that are looked for, to what to do."""
_DIMENSIONS = "Set corpus.importer.dim=2 for points in the picture, dim=3 for points in space"


def read_landmarks(path: str | Path, dimensions: int = 2) -> Landmarks:
    """The landmarks in a ``.csv`` (OpenFace) or ``.npz`` file, or in a folder of ``.pts`` files, one a frame.

    Args:
        path: the file or folder.
        dimensions: 2 for points in the picture, 3 for points in space (``.pts`` files have none).

    Raises:
        DnnvssError: another kind of file, or a damaged one.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if dimensions == 3 and (path.is_dir() or suffix == ".pts"):
        raise DnnvssError("points of .pts files have no third coordinate", file=path, remedy=_DIMENSIONS)
    if path.is_dir():
        return read_pts_sequence(path.glob("*.pts"), path)
    match suffix:
        case ".csv":
            return read_openface(path, dimensions)
        case ".npz":
            return read_npz(path, dimensions=dimensions)
        case ".pts":
            return read_pts_sequence([path], path)
    raise DnnvssError(f"landmarks of the kind {path.suffix!r} are not understood", file=path,
                      remedy=f"Give a folder of .pts files, an OpenFace .csv or an .npz. {_NPZ}")


def read_pts(path: str | Path) -> np.ndarray:
    """Return the points (P, 2) float32 of one ``.pts`` file.

    Raises:
        DnnvssError: unreadable, a line without two numbers, or another number of points than announced; names the line.
    """
    path = Path(path)
    text = files.read_text(path, _PTS)
    rows = []
    inside, announced = False, None
    for place, line in enumerate(text.splitlines(), start=1):
        head, opened, behind = ("", "", line) if inside else line.partition("{")
        if match := re.fullmatch(r"\s*n_points:\s*(\d{1,9})\s*", head, re.ASCII):
            announced = int(match.group(1))
        inside = inside or bool(opened)
        body, closed, _ = behind.partition("}")
        if body.strip() and not body.lstrip().startswith("#"):
            try:
                x, y = (_coordinate(v) for v in body.split())
            except ValueError as error:
                raise DnnvssError(f"line {place}: {body.strip()[:80]!r} is not X Y", file=path, remedy=_PTS) from error
            rows.append((x, y))
        if closed:
            break
    if not rows or (announced is not None and announced != len(rows)):
        raise DnnvssError(f"holds {len(rows)} points, its header says {announced}", file=path, remedy=_PTS)
    return np.array(rows, np.float32)


def _coordinate(text: str) -> float:
    """A coordinate; NaN where a tracker found no point."""
    return np.nan if NO_NUMBER.fullmatch(text) else comma_number(text)


def write_pts(path: str | Path, points: np.ndarray) -> Path:
    """Write points (P, 2) as one ``.pts`` file with six decimals and return the path."""
    body = "\n".join(f"{x:.6f} {y:.6f}" for x, y in np.asarray(points, dtype=float))
    return files.write_text(path, f"version: 1\nn_points: {len(points)}\n{{\n{body}\n}}\n")


def read_pts_sequence(paths: Iterable[Path], source: Path) -> Landmarks:
    """Return the landmarks in ``.pts`` files, a frame each, in the order of the last number in their names.

    A frame without a file, between the first and the last, is not valid. The first file is frame 0, whatever its
    number.

    Raises:
        DnnvssError: no file, a name without a number, two files of one frame, or different numbers of points.
    """
    numbered: dict[int, Path] = {}
    several = sorted(paths)
    for path in several:
        found = re.findall(r"[0-9]+", path.stem)
        if not found and len(several) > 1:
            raise DnnvssError("its name holds no frame number", file=path, remedy=_SEQUENCE)
        frame = int(found[-1]) if found and len(found[-1]) < _DIGITS else 0
        if found and len(found[-1]) >= _DIGITS:
            raise DnnvssError(f"its frame number has {len(found[-1])} digits", file=path, remedy=_SEQUENCE)
        if frame in numbered:
            raise DnnvssError(f"is frame {frame}, as {numbered[frame].name} is", file=path, remedy=_SEQUENCE)
        numbered[frame] = path
    if not numbered:
        raise DnnvssError("holds no .pts file", file=source, remedy=_SEQUENCE)
    shapes = {frame: read_pts(path) for frame, path in numbered.items()}
    first, last, count = min(shapes), max(shapes), len(shapes[min(shapes)])
    if last - first >= most_frames(len(shapes), count, 2):
        raise DnnvssError(f"is frame {last}, and there are {len(shapes)} files from frame {first}", file=numbered[last],
                          remedy=_SEQUENCE)
    points = np.full((last - first + 1, count, 2), np.nan, np.float32)
    for frame, shape in shapes.items():
        if len(shape) != count:
            raise DnnvssError(f"holds {len(shape)} points, {numbered[first].name} holds {count}", file=numbered[frame],
                              remedy="Use one markup for all frames")
        points[frame - first] = shape
    return Landmarks(points, np.array(np.isfinite(points).all(axis=(1, 2))))


class Marks(NamedTuple):
    """What a ``landmarks.json`` says of the landmarks beside it.

    Args:
        groups: name to half-open range of points; empty where none are described.
        scale: stored coordinates divided by it are pixels (millimetres).
        rate: frames a second, as text, where the files have no time stamps; None where it is not given.
        size: width and height in pixels of the pictures that the points lie in; None where it is not given.
    """

    groups: dict[str, tuple[int, int]]
    scale: float = 1.0
    rate: str | None = None
    size: tuple[int, int] | None = None


def read_marks(path: str | Path) -> Marks:
    """What a ``landmarks.json`` says; all of it may be absent.

    Whoever made the landmarks may note more there, such as a unit; only a name that looks like a slip is refused.

    Raises:
        DnnvssError: unreadable, of another shape, a misspelt name, or a scale, rate or size that is not above 0.
    """
    told = files.read_json(path, _MARKS)
    if isinstance(told, dict):
        told = {name: value for name, value in told.items() if name in _KNOWN or get_close_matches(name, _KNOWN, 1)}
    found = as_record(_Marks, told, path, _MARKS)
    for name, (first, end) in found.groups.items():
        if not 0 <= first < end:
            raise DnnvssError(f"the group {name} runs from {first} to {end}", file=path,
                              remedy="Give the first of its points, counted from 0, and the one after its last")
    if found.rate is not None:
        FrameClock.from_setting(found.rate, f"{path}: rate")
    return Marks(dict(found.groups), found.scale, None if found.rate is None else str(found.rate), found.size)


@dataclass(frozen=True)
class _Marks:
    """What a ``landmarks.json`` may hold."""

    groups: Mapping[str, tuple[int, int]] = setting({}, most=100_000)
    scale: float = setting(1.0, above=0)
    rate: int | float | str | None = None
    size: tuple[int, int] | None = setting(None, above=0, most=100_000)


_KNOWN = tuple(field.name for field in fields(_Marks))


def read_npz(path: str | Path, scale: float = 1.0, dimensions: int = 2, frames: int | None = None) -> Landmarks:
    """The landmarks in an npz file with ``points`` (F, P, 2 or 3) and, where known, ``valid`` and ``times`` (F,).

    Args:
        path: the file.
        scale: what the stored numbers are to be divided by to give pixels (millimetres).
        dimensions: how many coordinates a point must have; the depth of a face mesh is left out where it is 2.
        frames: of the video, where that is known: the file is then opened only if it holds no more than they need.

    Raises:
        DnnvssError: unreadable, arrays of other names or shapes, or far more than the video has frames.
    """
    most = None if frames is None else _SPARE + 8 * _POINTS * dimensions * (frames + 1)
    arrays = read_arrays(path, _NPZ, most, ("points", "valid", "times"))
    points = arrays.get("points")
    if points is not None and points.dtype.kind not in "fiu":
        raise DnnvssError(f"its points are {points.dtype}, not numbers", file=path, remedy=_NPZ)
    if points is None or points.ndim != 3 or not len(points):
        shapes = {name: value.shape for name, value in arrays.items()} or ", ".join(_members(path))
        raise DnnvssError(f"holds {shapes}, not points (frames, points, {dimensions})", file=path, remedy=_NPZ)
    if dimensions == 2 and points.shape[1] in MESHES and points.shape[2] == 3:
        points = points[..., :2]
    if points.shape[2] != dimensions:
        raise DnnvssError(f"its points have {points.shape[2]} coordinates, and {dimensions} are looked for: it is not "
                          f"points (frames, points, {dimensions})", file=path,
                          remedy=_OTHERS.get((points.shape[2], dimensions), _NPZ))
    scaled = np.asarray(points / scale, np.float32)
    valid = arrays.get("valid", np.isfinite(scaled).all(axis=(1, 2)))
    times = arrays.get("times")
    for name, rows in (("valid", valid), ("times", times)):
        if rows is not None and rows.dtype.kind not in "fiub":
            raise DnnvssError(f"its {name} are {rows.dtype}, not numbers", file=path, remedy=_NPZ)
    for name, rows in (("valid", valid), ("times", times)):
        if rows is not None and rows.shape != (len(scaled),):
            raise DnnvssError(f"{name} has the shape {rows.shape}, points {scaled.shape}", file=path, remedy=_NPZ)
    return Landmarks(scaled, valid.astype(bool), None if times is None else times.astype(float))


def _members(path: str | Path) -> list[str]:
    """The names of the arrays in an npz."""
    with zipfile.ZipFile(path) as archive:
        return [name.removesuffix(".npy") for name in archive.namelist()]


def write_npz(path: str | Path, landmarks: Landmarks) -> Path:
    """Write landmarks as an npz file and return the path."""
    times = {} if landmarks.times is None else {"times": landmarks.times}
    return files.write_arrays(path, points=landmarks.points, valid=landmarks.valid, **times)
