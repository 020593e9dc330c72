"""Facial landmarks of a clip: iBUG ``.pts``, OpenFace CSV and npz.

Coordinates are taken as they stand in the file. Tools differ by half a pixel or one in where they put the origin; the
difference is the same for every point of a corpus, so the appearance model does not see it.
"""

import csv
import json
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError

LAYOUT_68 = {
    "face_oval": (0, 17), "right_brow": (17, 22), "left_brow": (22, 27), "nose_bridge": (27, 31), "nose_base": (31, 36),
    "right_eye": (36, 42), "left_eye": (42, 48), "lips_outer": (48, 60), "lips_inner": (60, 68),
}
"""Groups of the 68-point markup of iBUG 300-W, which OpenFace and dlib follow."""

_PTS = "Write the file as: version: 1, n_points: N, {, N lines of X Y, }"
_SEQUENCE = "Name the files ID_000001.pts and so on, one a frame"
_CSV = "Give the CSV that OpenFace's FeatureExtraction writes, with columns frame, success, x_0 ... y_67"
_MARKS = 'Write {"groups": {"lips_outer": [48, 60], ...}, "scale": 1} there'
_NPZ = "Save an array points (frames, points, 2) in pixels and, where known, valid (frames,)"


@dataclass(frozen=True)
class Landmarks:
    """Points of every video frame.

    Args:
        points: (F, P, 2) float32, (x, y) in pixels; NaN where ``valid`` is False and nothing is known.
        valid: (F,) bool, whether the points of the frame were found.
    """

    points: np.ndarray
    valid: np.ndarray


def read_landmarks(path: str | Path) -> Landmarks:
    """Return the landmarks in a ``.csv`` (OpenFace) or ``.npz`` file, or in a folder of ``.pts`` files, one a frame.

    Raises:
        DnnvssError: another kind of file, or a damaged one.
    """
    path = Path(path)
    if path.is_dir():
        return read_pts_sequence(path.glob("*.pts"), path)
    match path.suffix.lower():
        case ".csv":
            return read_openface(path)
        case ".npz":
            return read_npz(path)
        case ".pts":
            return read_pts_sequence([path], path)
    raise DnnvssError(f"landmarks of the kind {path.suffix!r} are not understood", file=path,
                      remedy="Give a folder of .pts files, an OpenFace .csv or an .npz")


def read_pts(path: str | Path) -> np.ndarray:
    """Return the points (P, 2) float32 of one ``.pts`` file.

    Raises:
        DnnvssError: unreadable, a line without two numbers, or another number of points than announced; names the line.
    """
    path = Path(path)
    text = files.read(path, lambda p: p.read_text("utf-8"), _PTS)
    rows = []
    inside, announced = False, None
    for number, line in enumerate(text.splitlines(), start=1):
        body = line.strip()
        if body == "{":
            inside = True
        elif body == "}":
            break
        elif inside and body and not body.startswith("#"):
            try:
                x, y = (float(v) for v in body.split())
            except ValueError as error:
                raise DnnvssError(f"line {number}: {body!r} is not X Y", file=path, remedy=_PTS) from error
            rows.append((x, y))
        elif match := re.fullmatch(r"n_points:\s*(\d+)", body):
            announced = int(match.group(1))
    if not rows or (announced is not None and announced != len(rows)):
        raise DnnvssError(f"holds {len(rows)} points, its header says {announced}", file=path, remedy=_PTS)
    return np.array(rows, np.float32)


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
        found = re.findall(r"\d+", path.stem)
        if not found and len(several) > 1:
            raise DnnvssError("its name holds no frame number", file=path, remedy=_SEQUENCE)
        frame = int(found[-1]) if found else 0
        if frame in numbered:
            raise DnnvssError(f"is frame {frame}, as {numbered[frame].name} is", file=path, remedy=_SEQUENCE)
        numbered[frame] = path
    if not numbered:
        raise DnnvssError("holds no .pts file", file=source, remedy=_SEQUENCE)
    shapes = {frame: read_pts(path) for frame, path in numbered.items()}
    first, last, count = min(shapes), max(shapes), len(shapes[min(shapes)])
    points = np.full((last - first + 1, count, 2), np.nan, np.float32)
    for frame, shape in shapes.items():
        if len(shape) != count:
            raise DnnvssError(f"holds {len(shape)} points, {numbered[first].name} holds {count}", file=numbered[frame],
                              remedy="Use one markup for all frames")
        points[frame - first] = shape
    return Landmarks(points, np.array(np.isfinite(points).all(axis=(1, 2))))


def read_openface(path: str | Path) -> Landmarks:
    """Return the landmarks in an OpenFace CSV; frames with ``success`` 0 are not valid.

    Where the file follows several faces, the one with the highest summed confidence is taken. Frames are counted from 1
    in the file; one that has no row is not valid.

    Raises:
        DnnvssError: unreadable, columns missing, or a row that is not numbers; names the line.
    """
    path = Path(path)
    rows = files.read(path, lambda p: list(csv.reader(p.read_text("utf-8").splitlines())), _CSV)
    names = [name.strip() for name in rows[0]] if rows else []
    count = sum(bool(re.fullmatch(r"x_\d+", name)) for name in names)
    wanted = ["frame", "success", *[f"{axis}_{i}" for axis in "xy" for i in range(count)]]
    if not count or (missing := [name for name in wanted if name not in names]):
        raise DnnvssError(f"has no columns {' '.join(missing[:4]) if count else 'x_0, y_0'}", file=path, remedy=_CSV)
    table = np.empty((len(rows) - 1, len(names)))
    for number, row in enumerate(rows[1:], start=2):
        try:
            table[number - 2] = [float(v) for v in row]
        except ValueError as error:
            raise DnnvssError(f"line {number}: {len(row)} columns of {len(names)}, or a value that is not a number",
                              file=path, remedy=_CSV) from error
    if not len(table):
        raise DnnvssError("holds no frame", file=path, remedy=_CSV)
    column = {name: table[:, i] for i, name in enumerate(names)}
    if "face_id" in column and "confidence" in column:
        faces = np.unique(column["face_id"])
        best = max(faces, key=lambda face: column["confidence"][column["face_id"] == face].sum())
        column = {name: values[column["face_id"] == best] for name, values in column.items()}
    frame = column["frame"].astype(int) - 1
    points = np.full((frame.max() + 1, count, 2), np.nan, np.float32)
    points[frame] = np.stack([[column[f"{axis}_{i}"] for i in range(count)] for axis in "xy"]).T
    valid = np.zeros(len(points), bool)
    valid[frame] = column["success"] > 0
    return Landmarks(points, valid)


def write_openface(path: str | Path, landmarks: Landmarks, rate: float = 25.0) -> Path:
    """Write landmarks as a CSV with OpenFace's columns (frame, face_id, timestamp, confidence, success, x_i, y_i)."""
    count = landmarks.points.shape[1]
    lines = [", ".join(["frame", "face_id", "timestamp", "confidence", "success",
                        *[f"{axis}_{i}" for axis in "xy" for i in range(count)]])]
    for index, (shape, valid) in enumerate(zip(landmarks.points, landmarks.valid, strict=True)):
        values = ", ".join(f"{v:.6f}" for v in np.nan_to_num(shape.T.ravel().astype(float)))
        lines.append(f"{index + 1}, 0, {index / rate:.4f}, {float(valid):.2f}, {int(valid)}, {values}")
    return files.write_text(path, "\n".join(lines) + "\n")


def read_marks(path: str | Path) -> tuple[dict[str, tuple[int, int]], float]:
    """Return what a ``landmarks.json`` says: the groups (name to half-open range of points) and the scale.

    Both may be absent: no groups, and a scale of 1. Stored coordinates divided by the scale are pixels.

    Raises:
        DnnvssError: unreadable, of another shape, or a scale that is not above 0.
    """

    def marks(p: Path) -> tuple[dict[str, tuple[int, int]], float]:
        value = json.loads(p.read_text("utf-8"))
        return {g: (int(a), int(b)) for g, (a, b) in value.get("groups", {}).items()}, float(value.get("scale", 1.0))

    groups, scale = files.read(path, marks, _MARKS)
    if not 0 < scale < np.inf:
        raise DnnvssError(f"scale is {scale}", file=path, remedy="Give what the points are divided by, 1 for pixels")
    return groups, scale


def read_npz(path: str | Path, scale: float = 1.0) -> Landmarks:
    """Return the landmarks in an npz file with ``points`` (F, P, 2) and, where known, ``valid`` (F,).

    Args:
        path: the file.
        scale: what the stored numbers are to be divided by to give pixels.

    Raises:
        DnnvssError: unreadable, or arrays of other names or shapes.
    """
    arrays = files.read_arrays(path, _NPZ)
    points = arrays.get("points")
    if points is None or points.ndim != 3 or points.shape[2] != 2 or not len(points):
        shapes = {name: value.shape for name, value in arrays.items()}
        raise DnnvssError(f"holds {shapes}, not points (frames, points, 2)", file=path, remedy=_NPZ)
    pixels = np.asarray(points / scale, np.float32)
    valid = np.asarray(arrays.get("valid", np.isfinite(pixels).all(axis=(1, 2))), bool)
    if valid.shape != (len(pixels),):
        raise DnnvssError(f"valid has the shape {valid.shape}, points {pixels.shape}", file=path, remedy=_NPZ)
    return Landmarks(pixels, valid)


def write_npz(path: str | Path, landmarks: Landmarks) -> Path:
    """Write landmarks as an npz file and return the path."""
    return files.write_arrays(path, points=landmarks.points, valid=landmarks.valid)
