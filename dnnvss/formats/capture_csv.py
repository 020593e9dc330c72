"""Markers in the tables that Vicon Nexus and OptiTrack Motive export: heads of several lines above the frames."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats.curves import bounded_text, cell, check_names, spread_frames
from dnnvss.formats.numbers import comma_number
from dnnvss.formats.rows import Rows, table_rows
from dnnvss.formats.tracked import IN_MM, Markers

_REMEDY = "Export the take again as CSV with the trajectories of its markers, or as C3D or TRC"
_VICON, _MOTIVE = "trajectories", "format version"
_UNITS = {"meters": "m", "millimeters": "mm", "centimeters": "cm"}


def is_capture_csv(path: Path) -> bool:
    """Whether a CSV begins as Vicon's or Motive's do."""
    with path.open("rb") as file:
        head = file.read(200)
    first = head.decode(files.text_encoding(head), "replace").lstrip("\ufeff").lower()
    return first.startswith((_VICON, _MOTIVE))


def read_capture_csv(path: Path) -> Markers:
    """The markers in such a table, in millimetres; what stands before a colon in their names is left out.

    Raises:
        DnnvssError: unreadable, without markers, or a value that is no number; names the line.
    """
    text = bounded_text(path, _REMEDY)
    sign = max((",", ";", "\t"), key=text[:4000].count)
    rows, _ = files.read(path, lambda _: table_rows(f"sep={sign}\n{text}"), _REMEDY)
    rows = [(line - 1, cells) for line, cells in rows]
    try:
        head, starts, names, rate, unit = (
            _motive if rows[0][1][0].lower() == _MOTIVE else _vicon)(rows)
    except (IndexError, ValueError, StopIteration) as error:
        raise DnnvssError("has no head with the names of its markers", file=path, remedy=_REMEDY) from error
    if unit not in IN_MM:
        raise DnnvssError(f"is in the unit {unit!r}", file=path, remedy=f"Use one of {', '.join(IN_MM)}")
    check_names(path, names)
    frames = [(line, row) for line, row in rows[head:] if row[0].isdecimal()]
    if not frames or not 0 < rate <= 10_000:
        raise DnnvssError(f"holds {len(frames)} frames at {rate:g} a second", file=path, remedy=_REMEDY)
    points = np.array([[_point(path, line, row, name, at) for name, at in zip(names, starts, strict=True)]
                       for line, row in frames]) * IN_MM[unit]
    points = spread_frames(path, [line for line, _ in frames], [row[0] for _, row in frames], points)
    seen = np.isfinite(points).all(axis=2, keepdims=True)
    return Markers(tuple(names), np.where(seen, points, np.nan), rate)


Head = tuple[int, list[int], list[str], float, str]
"""Rows of the head, the first column and the name of each marker, frames a second, and the unit."""


def _vicon(rows: Rows) -> Head:
    """The head of Nexus: Trajectories, the rate, names over their x, the axes, the units."""
    at = next(k for k, (_, row) in enumerate(rows) if row[0].lower() == _VICON)
    labels, units = rows[at + 2][1], rows[at + 4][1]
    starts = [k for k in range(2, len(labels)) if labels[k]]
    rate = comma_number(rows[at + 1][1][0])
    return at + 5, starts, [_bare(labels[k]) for k in starts], rate, units[starts[0]].lower()


def _motive(rows: Rows) -> Head:
    """The head of Motive: pairs of name and value; type, name, id, position or rotation, and axis of each column."""
    pairs = dict(zip((c.lower() for c in rows[0][1][::2]), rows[0][1][1::2], strict=False))
    axes = next(k for k, (_, row) in enumerate(rows) if row[0].lower() == "frame")
    kinds = rows[axes - 1][1]
    typed = next(k for k in range(1, axes) if any("marker" in c.lower() for c in rows[k][1]))
    types, labels = rows[typed][1], rows[typed + 1][1]
    starts = [k for k in range(2, len(kinds) - 2) if kinds[k].lower() == "position" and types[k].lower() == "marker"
              and rows[axes][1][k].lower() == "x"]
    rate = comma_number(pairs.get("export frame rate") or pairs.get("capture frame rate", ""))
    unit = pairs.get("length units", "meters").lower()
    return axes + 1, starts, [_bare(labels[k]) for k in starts], rate, _UNITS.get(unit, unit)


def _bare(name: str) -> str:
    return name.rpartition(":")[2].strip()


def _point(path: Path, line: int, row: Sequence[str], name: str, at: int) -> list[float]:
    cells = [*row[at : at + 3], "", "", ""][:3]
    return [cell(path, line, name, text, comma_number) for text in cells]
