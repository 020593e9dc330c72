"""Named curves of a rig: the CSV of Live Link Face, and any CSV with a column for each curve."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats.drop_frame import frames_of, left_out
from dnnvss.formats.numbers import NO_NUMBER, whole
from dnnvss.formats.rows import Rows, table_rows

_CSV = (
    "Give the CSV that Live Link Face writes (Timecode, BlendShapeCount, a column for each curve), or one with a "
    "name over each column and, where known, a column time in seconds or frame"
)
MOST_BYTES = 400_000_000
"""Of a text file of curves or markers: an hour at 240 frames a second."""
_TIMECODE, _COUNT = "timecode", "blendshapecount"
_TIMES = ("time", "times", "timestamp", "timestamps", "seconds", "timeseconds")
_FRAMES = ("frame", "frames", "frame#", "framenumber", "framenr", "framenum")
_UNIT = re.compile(r"[_ ]*[\[(]?\b(s|sec|secs|seconds|ms|msec|milliseconds)\b[\])]?$|_(s|sec|ms)$")
_GAPS = 20
"""Frames that a table may skip for each that it has."""
_BASES = (24, 25, 30, 48, 50, 60, 100, 120, 240)
"""Frames a second that time codes count in."""
_DAY = 86_400
_CODE = re.compile(r"(\d{1,2}):(\d{1,2}):(\d{1,2})([:;])(\d{1,4}(?:\.\d{1,9})?)", re.ASCII)


@dataclass(frozen=True)
class Curves:
    """Curves of a rig over time.

    Args:
        names: of the curves, as the file has them.
        values: (F, C) float64; NaN where the file holds no number.
        times: (F,) seconds of the time stamps, rising; None where the file has none.
        counted: frames to the second of the time codes that the times are read from; None where they are no codes.
        drop: whether those are drop-frame: of frames at 29.97 or a multiple, and times of the clock.
        first: time code of the first frame, in a file that has time stamps beside its codes; empty elsewhere.
    """

    names: tuple[str, ...]
    values: np.ndarray
    times: np.ndarray | None = None
    counted: int | None = None
    drop: bool = False
    first: str = ""

    def since(self, rate: Fraction | None) -> np.ndarray:
        """Seconds (F,) from the first time stamp, where the file has any.

        Args:
            rate: frames a second, where it is known: time codes that count to the whole number beside 29.97 and its
                like, or to a multiple, fall behind the clock by a thousandth.
        """
        assert self.times is not None
        times = self.times - self.times[0]
        if rate is None or self.counted is None or self.drop or round(rate) * 1000 != rate * 1001:
            return times
        return times if self.counted % round(rate) else times * 1.001


def read_curves(path: str | Path, rate: Fraction | None = None) -> Curves:
    """The curves in a CSV: Live Link Face's, known by its column ``Timecode``, or one with a name over each column.

    A column ``BlendShapeCount`` is left out; so are ``time`` (or timestamp, seconds; ``time_ms``, ``Time (s)``), which
    gives the time stamps, and ``frame``, by which frames without a row are told where there is no time, and columns
    without a name that hold nothing or count the rows. Numbers and separators may be those of any country
    (:func:`dnnvss.formats.rows.table_rows`). Time codes ``h:m:s:frame`` count frames in the
    least usual rate above the largest frame number; midnight may be passed. Those that pass no second count to the
    rate, or to the whole number beside it. Codes ``h:m:s;frame`` that count to 30 or a multiple are drop-frame, if none
    is a number that those leave out.

    Args:
        path: the file.
        rate: frames a second, where it is known.

    Raises:
        DnnvssError: unreadable, a name that comes twice, no curve, a row of another length, a value that is no number,
            times that do not rise (names the line), or time codes that pass no second where the rate is not known.
    """
    path = Path(path)
    lines, number = read_table(path)
    names = list(lines[0][1])
    rows = [checked_row(path, line, row, len(names)) for line, row in lines[1:]]
    low = [_bare(name) for name in names]
    stamp = next((i for kinds in (_TIMES, (_TIMECODE,)) for i, name in enumerate(low) if name in kinds), None)
    aside = {i for i, name in enumerate(low) if name in (_COUNT, _TIMECODE, *_TIMES, *_FRAMES)}
    aside |= {i for i, name in enumerate(names) if not name and _says_nothing([row[i] for row in rows])}
    names = [name or f"column {i + 1}" for i, name in enumerate(names)]
    kept = [i for i in range(len(names)) if i not in aside]
    check_names(path, [names[i] for i in kept])
    places = [line for line, _ in lines[1:]]
    values = np.array(
        [
            [cell(path, at, names[i], row[i], number) for i in kept]
            for at, row in zip(places, rows, strict=True)
        ]
    )
    times, base, drop = (
        (None, None, False)
        if stamp is None
        else _times(path, places, [row[stamp] for row in rows], low[stamp], number, rate)
    )
    if times is not None and stamp is not None and _in_ms(names[stamp]):
        times = times / 1000
    counted = next((i for i, name in enumerate(low) if name in _FRAMES), None)
    if times is None and counted is not None:
        values = spread_frames(path, places, [row[counted] for row in rows], values)
    codes = next((i for i, name in enumerate(low) if name == _TIMECODE and i != stamp), None)
    first = "" if codes is None or not _CODE.fullmatch(code := lines[1][1][codes]) else code.partition(".")[0]
    return Curves(tuple(names[i] for i in kept), values, times, base, drop, first)


def _bare(name: str) -> str:
    """The name of a column in one case, without spaces; that of a time without its unit."""
    low = name.strip().lower()
    bare = _UNIT.sub("", low).replace(" ", "").replace("_", "")
    return bare if bare in _TIMES or bare in _FRAMES else low.replace(" ", "")


def _in_ms(name: str) -> bool:
    unit = _UNIT.search(name.strip().lower())
    return unit is not None and (unit[1] or unit[2]).startswith("m")


def _says_nothing(cells: Sequence[str]) -> bool:
    """Whether a column is empty, or counts the rows as some programs do."""
    return not any(cells) or cells in ([str(k) for k in range(len(cells))], [str(k + 1) for k in range(len(cells))])


def spread_frames(
    path: Path, places: Sequence[int], texts: Sequence[str], values: np.ndarray
) -> np.ndarray:
    """Rows (F, ...) at the numbers of their frames, the first one first; frames without a row are NaN.

    Raises:
        DnnvssError: a number that is none, does not rise, or is far beyond the rows; names the line.
    """
    frames: list[int] = []
    for at, text in zip(places, texts, strict=True):
        try:
            frame = whole(text)
        except ValueError as error:
            raise DnnvssError(
                f"line {at}: {text[:40]!r} is no number of a frame", file=path, remedy=_CSV
            ) from error
        if frames and frame <= frames[-1]:
            raise DnnvssError(
                f"line {at}: frame {frame} does not come after {frames[-1]}", file=path, remedy=_CSV
            )
        frames.append(frame)
    count = frames[-1] - frames[0] + 1
    if count > _GAPS * len(frames):
        raise DnnvssError(
            f"has {len(frames)} rows for the frames {frames[0]} to {frames[-1]}", file=path, remedy=_CSV
        )
    spread = np.full((count, *values.shape[1:]), np.nan)
    spread[np.array(frames) - frames[0]] = values
    return spread


def write_curves(path: str | Path, curves: Curves) -> Path:
    """Write curves as a CSV with a column ``time`` (where known) before theirs, ten digits a number; return the path.

    Raises:
        DnnvssError: a name holds a comma, a quotation mark or a line break.
    """
    if bad := [n for n in curves.names if re.search(r'[,"\n\r]', n)]:
        raise DnnvssError(
            f"the curve {bad[0]!r} cannot be the name of a column", remedy="Rename it"
        )
    stamped = curves.times is not None
    table = (
        curves.values if curves.times is None else np.column_stack([curves.times, curves.values])
    )
    lines = [",".join([*(["time"] if stamped else []), *curves.names])]
    lines += [",".join("" if np.isnan(v) else f"{v:.10g}" for v in row) for row in table]
    return files.write_text(path, "\n".join(lines) + "\n")


def read_table(path: Path) -> tuple[Rows, Callable[[str], float]]:
    """The rows of a text file with a head and a frame at least, and what reads a number of it.

    Raises:
        DnnvssError: unreadable, larger than :data:`MOST_BYTES`, or without a frame.
    """
    text = bounded_text(path, _CSV)
    lines, number = files.read(path, lambda _: table_rows(text), _CSV)
    if len(lines) < 2:
        raise DnnvssError("holds no frame", file=path, remedy=_CSV)
    return lines, number


def bounded_text(path: Path, remedy: str) -> str:
    """The text of a file of no more than :data:`MOST_BYTES`.

    Raises:
        DnnvssError: unreadable, or larger.
    """
    if path.is_file() and path.stat().st_size > MOST_BYTES:
        raise DnnvssError(
            f"has {path.stat().st_size / 1e6:,.0f} MB, and {MOST_BYTES / 1e6:,.0f} MB are an hour at 240 "
            "frames a second",
            file=path,
            remedy="Cut it into takes",
        )
    return files.read_text(path, remedy)


def check_names(path: Path, names: Sequence[str]) -> None:
    """Refuse a table without a named column, or with one that comes twice."""
    if not names:
        raise DnnvssError("has no column of values", file=path, remedy=_CSV)
    if double := next((name for i, name in enumerate(names) if name in names[:i]), None):
        raise DnnvssError(f"has two columns {double!r}", file=path, remedy=_CSV)


def checked_row(path: Path, line: int, row: list[str], width: int) -> list[str]:
    """A row of so many cells, without empty ones behind them.

    Raises:
        DnnvssError: it has more or fewer; names the line.
    """
    while len(row) > width and not row[-1]:
        row = row[:-1]
    if len(row) != width:
        raise DnnvssError(f"line {line}: {len(row)} columns of {width}", file=path, remedy=_CSV)
    return row


def cell(path: Path, line: int, name: str, text: str, number: Callable[[str], float]) -> float:
    """The number in a cell; NaN where a tool writes that there is none.

    Raises:
        DnnvssError: it is other text; names the line and the column.
    """
    if NO_NUMBER.fullmatch(text):
        return float("nan")
    try:
        return number(text)
    except ValueError as error:
        raise DnnvssError(
            f"line {line}: {name} is {text[:80]!r}, which is not a number", file=path, remedy=_CSV
        ) from error


def _times(
    path: Path,
    places: Sequence[int],
    texts: Sequence[str],
    kind: str,
    number: Callable[[str], float],
    rate: Fraction | None,
) -> tuple[np.ndarray, int | None, bool]:
    """The seconds (F,) of time stamps or time codes, rising, what frames to the second the codes count, and whether
    they are drop-frame."""
    base, drop = None, False
    if kind == _TIMECODE:
        times, base, drop = _seconds(path, places, texts, rate)
    else:
        times = np.array(
            [cell(path, at, kind, text, number) for at, text in zip(places, texts, strict=True)]
        )
    day = frames_of(np.array([_DAY * base]), base)[0] * 1.001 / base if base and drop else _DAY
    times = times + day * np.concatenate([[0], np.cumsum(np.diff(times) < -_DAY / 2)])
    wrong = np.flatnonzero(~(np.diff(times, prepend=-np.inf) > 0))
    if len(wrong):
        raise DnnvssError(
            f"line {places[wrong[0]]}: the time {texts[wrong[0]][:40]!r} does not come after the one "
            "before it",
            file=path,
            remedy=_CSV,
        )
    return np.asarray(times), base, drop


def _seconds(
    path: Path, places: Sequence[int], texts: Sequence[str], rate: Fraction | None
) -> tuple[np.ndarray, int, bool]:
    """The seconds (F,) since midnight of time codes ``h:m:s:frame``, the frames to the second, and whether the codes
    are drop-frame."""
    found = [_CODE.fullmatch(text) for text in texts]
    for at, text, match in zip(places, texts, found, strict=True):
        if match is None:
            raise DnnvssError(
                f"line {at}: {text[:40]!r} is no time code hours:minutes:seconds:frame",
                file=path,
                remedy=_CSV,
            )
    parts = np.array(
        [[float(whole(m[1])), float(m[2]), float(m[3]), float(m[5])] for m in found if m]
    )
    base = _base(path, parts, rate)
    labels = parts @ np.array([3600.0 * base, 60.0 * base, base, 1.0])
    marked = base % 30 == 0 and all(m[4] == ";" for m in found if m)
    if marked and not left_out(labels, base).any():
        return frames_of(labels, base) * 1.001 / base, base, True
    return parts @ np.array([3600.0, 60.0, 1.0, 1 / base]), base, False


def _base(path: Path, parts: np.ndarray, rate: Fraction | None) -> int:
    """Frames to the second that time codes count, from their hours, minutes, seconds and frames (F, 4)."""
    most = parts[:, 3].max()
    base = next((b for b in _BASES if b > most), None)
    if base is None:
        raise DnnvssError(
            f"has the frame {most:g} in its time code, more than {_BASES[-1]} a second", file=path, remedy=_CSV
        )
    if (parts[:, :3] != parts[0, :3]).any():
        return base
    if rate is None or round(rate) <= most:
        raise DnnvssError(
            f"its time codes go to frame {most:g} and pass no second, which does not tell how many frames make one",
            file=path,
            remedy="Give the frame rate that they count",
        )
    return round(rate)
