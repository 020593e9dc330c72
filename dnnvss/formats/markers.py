"""Markers of motion capture in space: TRC, and CSV with three columns for each marker; C3D has its own file."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats.c3d import read_c3d
from dnnvss.formats.capture_csv import is_capture_csv, read_capture_csv
from dnnvss.formats.curves import (
    bounded_text,
    cell,
    check_names,
    checked_row,
    read_curves,
    spread_frames,
)
from dnnvss.formats.numbers import comma_number
from dnnvss.formats.tracked import IN_MM, Markers

_TRC = "Give the TRC that the capture system exports: five lines of head, then a frame a line"
_KINDS = "Give a .c3d, .trc or .csv file"
_AXIS = re.compile(r"(.+?)[ _:.\-]?([xyz])", re.IGNORECASE)
_HEAD = 5
"""Lines before the first frame of a TRC."""
_MOST_MARKERS = 10_000


def read_markers(path: str | Path) -> Markers:
    """The markers in a ``.c3d``, ``.trc`` or ``.csv`` file, in millimetres.

    Raises:
        DnnvssError: another kind of file, or a damaged one.
    """
    path = Path(path)
    match path.suffix.lower():
        case ".c3d":
            return read_c3d(path)
        case ".trc":
            return read_trc(path)
        case ".csv":
            return read_markers_csv(path)
    raise DnnvssError(
        f"markers of the kind {path.suffix!r} are not understood", file=path, remedy=_KINDS
    )


def marker_columns(names: Sequence[str]) -> dict[str, tuple[int, int, int]] | None:
    """Marker to the columns of its x, y and z, where all columns are such (``NAME_x``, ``NAME:X``, ...); else None."""
    found: dict[str, dict[str, int]] = {}
    for i, name in enumerate(names):
        match = _AXIS.fullmatch(name)
        if match is None:
            return None
        found.setdefault(match[1], {})[match[2].lower()] = i
    if any(len(axes) != 3 for axes in found.values()) or 3 * len(found) != len(names):
        return None
    return {name: (axes["x"], axes["y"], axes["z"]) for name, axes in found.items()}


def read_markers_csv(path: str | Path) -> Markers:
    """The markers in a CSV with columns ``NAME_x``, ``NAME_y``, ``NAME_z`` in millimetres, or in Vicon's or Motive's.

    An empty cell is a gap, and so are frames that the times skip.

    Raises:
        DnnvssError: what :func:`read_curves` refuses, or columns that are no markers'.
    """
    if Path(path).is_file() and is_capture_csv(Path(path)):
        return read_capture_csv(Path(path))
    curves = read_curves(path)
    columns = marker_columns(curves.names)
    if columns is None:
        raise DnnvssError(
            "has columns that are no markers', such as " + ", ".join(curves.names[:3]),
            file=Path(path),
            remedy="Name the columns NAME_x, NAME_y, NAME_z",
        )
    points = curves.values[:, np.array(list(columns.values()))]
    rate = None
    if curves.times is not None and len(curves.times) > 1:
        rate = float(1 / np.median(np.diff(curves.times)))
        frames = np.round((curves.times - curves.times[0]) * rate).astype(int)
        points = spread_frames(
            Path(path), range(2, len(frames) + 2), [str(k) for k in frames], points
        )
    return Markers(tuple(columns), _gapped(points), rate)


def read_trc(path: str | Path) -> Markers:
    """The markers in a TRC, in millimetres; a marker without numbers in a frame is missing there.

    Raises:
        DnnvssError: unreadable, a head that is none, or a line that does not fit it; names the line.
    """
    path = Path(path)
    lines = bounded_text(path, _TRC).split("\n")
    if len(lines) <= _HEAD or not lines[0].lower().startswith("pathfiletype"):
        raise DnnvssError("does not begin as a TRC does (PathFileType)", file=path, remedy=_TRC)
    head = dict(zip((w.lower() for w in lines[1].split("\t")), lines[2].split("\t"), strict=False))
    rate, unit = _rate(path, head.get("datarate", "")), head.get("units", "mm").strip().lower()
    if unit not in IN_MM:
        raise DnnvssError(
            f"is in the unit {unit!r}", file=path, remedy=f"Use one of {', '.join(IN_MM)}"
        )
    names = [name.strip() for name in lines[3].split("\t")[2:] if name.strip()]
    check_names(path, names)
    _check_count(path, "markers", head.get("nummarkers", ""), len(names))
    if len(names) > _MOST_MARKERS:
        raise DnnvssError(f"has {len(names)} markers", file=path, remedy=_TRC)
    width = 2 + 3 * len(names)
    rows, places, frames = [], [], []
    for at, line in enumerate(lines[_HEAD:], start=_HEAD + 1):
        if line.strip():
            cells = [c.strip() for c in line.split("\t")]
            cells += [""] * (width - len(cells))  # gaps at the end of a line
            row = checked_row(path, at, cells, width)
            places.append(at)
            frames.append(row[0])
            rows.append(
                [cell(path, at, names[i // 3], c, comma_number) for i, c in enumerate(row[2:])]
            )
    if not rows:
        raise DnnvssError("holds no frame", file=path, remedy=_TRC)
    _check_count(path, "frames", head.get("numframes", ""), len(rows))
    points = np.array(rows).reshape(len(rows), len(names), 3) * IN_MM[unit]
    points = spread_frames(path, places, frames, points)
    return Markers(tuple(names), _gapped(points), rate)


def _check_count(path: Path, what: str, told: str, count: int) -> None:
    """Refuse a TRC that holds less than its head tells: it was cut short."""
    if told.strip().isdecimal() and int(told) > count:
        raise DnnvssError(
            f"holds {count} {what}, and its head tells of {int(told)}", file=path, remedy=_TRC
        )


def write_trc(path: str | Path, markers: Markers) -> Path:
    """Write markers as TRC in millimetres, six decimals, and return the path; markers without a rate are an error.

    Raises:
        DnnvssError: the rate is not known.
    """
    if markers.rate is None:
        raise DnnvssError("markers without a rate cannot be a TRC", remedy="Give frames a second")
    frames, count = markers.points.shape[:2]
    told = (
        f"{markers.rate:g}\t{markers.rate:g}\t{frames}\t{count}\tmm\t{markers.rate:g}\t1\t{frames}"
    )
    names = "".join(f"\t{name}\t\t" for name in markers.names)
    axes = "".join(f"\tX{i}\tY{i}\tZ{i}" for i in range(1, count + 1))
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{Path(path).name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        told,
        f"Frame#\tTime{names}",
        f"\t{axes}",
    ]
    for k, frame in enumerate(markers.points.reshape(frames, -1)):
        cells = "\t".join("" if np.isnan(v) else f"{v:.6f}" for v in frame)
        lines.append(f"{k + 1}\t{k / markers.rate:.6f}\t{cells}")
    return files.write_text(path, "\n".join(lines) + "\n")


def _rate(path: Path, text: str) -> float:
    try:
        rate = comma_number(text)
    except ValueError:
        rate = 0.0
    if not 0 < rate <= 10_000:
        raise DnnvssError(f"has the rate {text[:40]!r} (DataRate)", file=path, remedy=_TRC)
    return rate


def _gapped(points: np.ndarray) -> np.ndarray:
    """Points (F, M, 3) that are NaN in all three coordinates where one is, or where all are exactly 0, as systems write
    a marker that they lost."""
    seen = np.isfinite(points).all(axis=2, keepdims=True) & (points != 0).any(axis=2, keepdims=True)
    return np.where(seen, points, np.nan)
