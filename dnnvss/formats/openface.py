"""OpenFace's CSV: landmarks in the picture or in space, by the names of their columns."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats.numbers import NO_NUMBER
from dnnvss.formats.rows import table_rows

_CSV = ("Give the CSV that OpenFace's FeatureExtraction writes, with columns frame, success, x_0 ... y_67 "
        "(X_0 ... Z_67 for points in space), or save points of another tracker as an .npz: "
        "numpy.savez(file, points=...), (frames, points, 2)")
_AXES = {2: ("x", "y"), 3: ("X", "Y", "Z")}
"""Names of the columns before the underscore: in pixels of the picture, in millimetres before the camera."""
_FEW, _GAPS = 64_000_000, 20


def most_frames(rows: int, points: int, dimensions: int) -> int:
    """The frames that a file with so many rows may tell of; beyond, a frame number is a mistake.

    There may be twenty frames for each row, or as many as 64 MB of points hold.
    """
    return max(_FEW // (4 * points * dimensions), _GAPS * rows)


@dataclass(frozen=True)
class Landmarks:
    """Points of every video frame.

    Args:
        points: (F, P, 2) float32, (x, y) in pixels, or (F, P, 3), (x, y, z) in millimetres with z away from the
            viewer; NaN where ``valid`` is False and nothing is known.
        valid: (F,) bool, whether the points of the frame were found.
        times: (F,) float64, the time stamps in seconds, NaN for frames without one; None where the file has none.
        faces: how many the file follows, of which this is one.
    """

    points: np.ndarray
    valid: np.ndarray
    times: np.ndarray | None = None
    faces: int = 1


def read_openface(path: str | Path, dimensions: int = 2) -> Landmarks:
    """The landmarks in an OpenFace CSV; frames with ``success`` 0 or a value that is no number are not valid.

    Columns are found by name; their order, spaces round their names and columns that are not needed do not matter.
    Where the file follows several faces, the one that is largest for longest is taken: a picture on the wall is small,
    and a tracker may be surer of it than of somebody who speaks. Frames are counted from
    1 in the file (from 0 where it has one of that number); one that has no row, or a last one that breaks off, is not
    valid. Time stamps are read where there is a column ``timestamp``.

    Args:
        path: the file.
        dimensions: 2 for ``x_i y_i`` in pixels, 3 for ``X_i Y_i Z_i`` in millimetres.

    Raises:
        DnnvssError: unreadable, columns missing or named twice, a row that is too short or long, a value that is no
            number, or a frame that comes twice; names the line.
    """
    path = Path(path)
    text = files.read_text(path, _CSV)
    lines, number = files.read(path, lambda _: table_rows(text), _CSV)
    names = lines[0][1] if lines else []
    axes = _AXES[dimensions]
    count = sum(bool(re.fullmatch(rf"{axes[0]}_\d+", name)) for name in names)
    coordinates = [f"{axis}_{i}" for i in range(count) for axis in axes]
    place = _places(path, names, ["frame", "success", *(coordinates or [f"{axis}_0" for axis in axes])])
    if len(lines) == 1:
        raise DnnvssError("holds no frame", file=path, remedy=_CSV)
    if len(lines) > 2 and len(lines[-1][1]) < len(names) and not text.endswith("\n"):
        lines = lines[:-1]  # the tracker was stopped while it wrote
    optional = [name for name in ("face_id", "confidence", "timestamp") if name in place]
    wanted = ["frame", "success", *optional, *coordinates]
    table = np.array([_row(path, line, row, names, wanted, place, number) for line, row in lines[1:]])
    column = {name: table[:, i] for i, name in enumerate(wanted)}
    kept, faces = _one_face(column, table[:, -len(coordinates):].reshape(len(table), count, dimensions))
    numbers = np.array([line for line, _ in lines[1:]])[kept]
    frame = _frames(path, column["frame"][kept], numbers, most_frames(len(numbers), count, dimensions))
    points = np.full((frame.max() + 1, count, dimensions), np.nan, np.float32)
    points[frame] = table[kept, -len(coordinates):].reshape(-1, count, dimensions)
    valid = np.zeros(len(points), bool)
    valid[frame] = column["success"][kept] > 0
    times = None
    if "timestamp" in place:
        times = np.full(len(points), np.nan)
        times[frame] = column["timestamp"][kept]
    return Landmarks(points, valid & np.isfinite(points).all(axis=(1, 2)), times, faces)


def _places(path: Path, names: Sequence[str], wanted: Sequence[str]) -> dict[str, int]:
    """Name of a column to its place; ``wanted`` are there, once."""
    if missing := [name for name in wanted if name not in names]:
        raise DnnvssError(f"has no columns {', '.join(missing[:4])}", file=path, remedy=_CSV)
    place = {name: i for i, name in enumerate(names) if name}
    if double := [name for name in wanted if names.count(name) > 1]:
        raise DnnvssError(f"has two columns {double[0]}", file=path, remedy=_CSV)
    return place


def _row(path: Path, line: int, row: Sequence[str], names: Sequence[str], wanted: Sequence[str],
         place: Mapping[str, int], number: Callable[[str], float]) -> list[float]:
    """The wanted values of a line; coordinates that are no number become NaN."""
    cells = list(row)
    while len(cells) > len(names) and not cells[-1]:  # a comma at the end
        cells.pop()
    if len(cells) != len(names):
        raise DnnvssError(f"line {line}: {len(cells)} columns of {len(names)}", file=path, remedy=_CSV)
    return [_value(path, line, name, cells[place[name]], number) for name in wanted]


_SAID = {"true": 1.0, "false": 0.0}
"""What pandas makes of 1 and 0."""


def _value(path: Path, line: int, name: str, text: str, number: Callable[[str], float]) -> float:
    if NO_NUMBER.fullmatch(text) and name != "frame":
        return np.nan
    if name == "success" and text.lower() in _SAID:
        return _SAID[text.lower()]
    try:
        return number(text)
    except ValueError as error:
        raise DnnvssError(f"line {line}: {name} is {text[:80]!r}, which is not a number", file=path,
                          remedy=_CSV) from error


def _one_face(column: Mapping[str, np.ndarray], points: np.ndarray) -> tuple[np.ndarray, int]:
    """Which rows (N,) follow the face that is largest for longest, and how many faces are followed.

    A tracker that loses a face gives it another number: faces that are never there together, and stand where it stood
    at its size, are that face.

    Args:
        column: values (N,) by name.
        points: (N, P, 2 or 3) of the rows.
    """
    if "face_id" not in column:
        return np.ones(len(points), bool), 1
    found = (column["success"] > 0) & np.isfinite(points).all(axis=(1, 2))
    high = np.where(found, np.ptp(np.nan_to_num(points[..., 1]), axis=1), 0.0)
    sure = np.nan_to_num(column["confidence"]) if "confidence" in column else np.zeros(len(points))
    faces = np.nan_to_num(column["face_id"], nan=-1)  # rows without a number are of no face that is known
    numbers = np.unique(faces)
    rows = {face: faces == face for face in numbers}
    best = max(numbers, key=lambda face: (high[rows[face]].sum(), sure[rows[face]].sum()))
    chosen, count = np.array(rows[best]), int(sum(found[r].any() for r in rows.values()))
    place = {face: np.median(points[rows[face] & found].reshape(-1, points.shape[-1]), axis=0)
             for face in numbers if (rows[face] & found).any()}
    tall = {face: float(np.median(high[rows[face] & found])) for face in place}
    for face in sorted(place, key=lambda f: -float(high[rows[f]].sum())):
        apart = not set(column["frame"][rows[face]]) & set(column["frame"][chosen])
        if face not in (best, -1) and best in place and apart and (
                np.linalg.norm(place[face] - place[best]) < tall[best] and 0.5 < tall[face] / tall[best] < 2):
            chosen |= rows[face]
            count -= 1
    return chosen, count


def _frames(path: Path, counted: np.ndarray, numbers: np.ndarray, most: int) -> np.ndarray:
    """The frames (N,), from 0, of rows that the file counts from 1 or 0; ``numbers`` (N,) are their lines."""
    first = 0 if (counted == 0).any() else 1
    wrong = ~((counted >= first) & (counted <= most) & (counted == np.round(counted)))
    if wrong.any():
        at = int(np.flatnonzero(wrong)[0])
        raise DnnvssError(f"line {numbers[at]}: frame is {counted[at]:g}, which is not the number of a frame",
                          file=path, remedy=_CSV)
    frame = counted.astype(int) - first
    order = np.argsort(frame, kind="stable")
    again = order[1:][np.diff(frame[order]) == 0]
    if len(again):
        raise DnnvssError(f"line {numbers[again[0]]}: frame {counted[again[0]]:g} comes a second time", file=path,
                          remedy="Keep one row a frame, or give face_id and confidence of each")
    return frame


def write_openface(path: str | Path, landmarks: Landmarks, rate: float = 25.0) -> Path:
    """Write landmarks as a CSV with OpenFace's columns: frame, face_id, timestamp, confidence, success, points.

    Args:
        path: the file.
        landmarks: ``x_i y_i`` are written, or ``X_i Y_i Z_i`` for points in space.
        rate: frames a second, where the landmarks have no time stamps.
    """
    count, dimensions = landmarks.points.shape[1:]
    lines = [", ".join(["frame", "face_id", "timestamp", "confidence", "success",
                        *[f"{axis}_{i}" for axis in _AXES[dimensions] for i in range(count)]])]
    times = np.arange(len(landmarks.points)) / rate if landmarks.times is None else landmarks.times
    for index, (shape, valid, time) in enumerate(zip(landmarks.points, landmarks.valid, times, strict=True)):
        values = ", ".join(f"{v:.6f}" for v in np.nan_to_num(shape.T.ravel().astype(float)))
        lines.append(f"{index + 1}, 0, {time:.4f}, {float(valid):.2f}, {int(valid)}, {values}")
    return files.write_text(path, "\n".join(lines) + "\n")
