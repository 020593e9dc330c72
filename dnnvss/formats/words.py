"""Word times as a table for spreadsheets, its columns found by their names."""

import csv
import io
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats.labels import phone_tier, word_tier
from dnnvss.formats.rows import Rows, table_rows
from dnnvss.timing import Alignment, Segment, Tier
from dnnvss.timing.tiers import TOLERANCE

_REMEDY = "Write the header start,end,word and a line a word, times in seconds"
_NAMES = {
    "start": ("start", "begin", "begin_time", "start_time", "starttime", "onset", "tmin", "xmin", "from"),
    "end": ("end", "stop", "end_time", "endtime", "offset", "tmax", "xmax", "to"),
    "duration": ("duration", "dur", "length"),
    "word": ("word", "text", "label", "token", "transcript"),
    "kind": ("type", "tier"),
}
"""What tools call the columns; of several for one thing, the first counts."""
_UNIT = re.compile(r"[ _]*[\[(]?(?<![^\W_])(s|sec|secs|seconds|ms|msec|milliseconds)[\])]?$")
_WORDS, _PHONES = ("word", "words"), ("phone", "phones")


TOUCH = 0.05
"""Seconds by which neighbours may overlap: recognisers round and pad; the second then begins where the first ends."""


class Columns(NamedTuple):
    """Where a table of times has what; None where it has not.

    Args:
        start, last, word, kind: columns, from 0.
        lasts: whether ``last`` is a duration and not an end.
        unit: seconds of the unit of times.
        headed: the first line names them.
    """

    start: int
    last: int
    word: int
    kind: int | None
    lasts: bool = False
    unit: float = 1.0
    headed: bool = True


def is_words_csv(path: Path) -> bool:
    """Whether a table is one of words and not of landmarks, by its first line."""
    rows, _ = table_rows(head_of(path))
    return bool(rows) and columns_of(rows[0][1]) is not None


def head_of(path: Path) -> str:
    """The first lines of a file."""
    head = files.read(path, _begins, "Give a table of words: the line start,end,word and a line a word")
    lines = head.decode(files.text_encoding(head), "replace").lstrip("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    return lines.rpartition("\n")[0] or lines


def _begins(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(_FIRST)


_FIRST = 4096
"""Bytes in which the first line of a table of words ends."""


def columns_of(row: Sequence[str]) -> Columns | None:
    """The columns of a table of times by its first line, None for a table of other things.

    Without names there are three: two numbers and a text.
    """
    plain = [name.strip().lower() for name in row]
    bare = [_UNIT.sub("", name).strip().replace(" ", "_") for name in plain]
    at = {what: next((bare.index(n) for n in names if n in bare), None) for what, names in _NAMES.items()}
    start, word = at["start"], at["word"]
    lasts = at["end"] is None
    last = at["duration"] if lasts else at["end"]
    if start is not None and word is not None and last is not None:
        unit = _UNIT.search(plain[start])
        return Columns(start, last, word, at["kind"], lasts, 0.001 if unit and unit[1].startswith("m") else 1.0)
    try:
        timed = len(row) == 3 and _clock(row[0], _plain) <= _clock(row[1], _plain) and not _is_number(row[2])
    except ValueError:
        timed = False
    return Columns(0, 1, 2, None, headed=False) if timed else None


def _plain(text: str) -> float:
    return float(text.replace(",", "."))


def _is_number(text: str) -> bool:
    return not re.search(r"[^\W\d_]", text)


def _clock(text: str, number: Callable[[str], float]) -> float:
    """Seconds of a number, or of hours, minutes and seconds with colons between them."""
    parts = [number(part) for part in text.split(":")]
    if len(parts) > 3 or any(part < 0 for part in parts):
        raise ValueError(f"{text!r} is no time")
    return sum(part * 60.0**k for k, part in enumerate(reversed(parts)))


def write_words_csv(path: str | Path, alignment: Alignment) -> Path:
    """Write the words as CSV with the columns start, end (seconds) and word, pauses left out; return the path."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["start", "end", "word"])
    writer.writerows([f"{s.start:.4f}", f"{s.end:.4f}", s.label] for s in alignment["words"] if s.label)
    return files.write_text(path, text.getvalue())


def read_words_csv(path: str | Path) -> Alignment:
    """The tier ``words`` of a table of times, and ``phones`` where it has rows of them; what is between is ``""``.

    Columns are found by their names, in any order and among others: start (begin, tmin), end or duration, word (text,
    label), and type or tier, as the Montreal Forced Aligner and Praat write them. Without names they are start, end
    and word. Cells may be parted by semicolons or tabs, and numbers then have decimal commas; times may be
    ``h:m:s``.

    Raises:
        DnnvssError: unreadable, another header, no word, a row that is not of this form, or words that overlap; names
            file and line.
    """
    path = Path(path)
    rows, number = files.read(path, lambda p: table_rows(files.read_text(p, _REMEDY)), _REMEDY)
    columns = columns_of(rows[0][1]) if rows else None
    if columns is None:
        raise DnnvssError(f"line {rows[0][0] if rows else 1} is not start,end,word", file=path, remedy=_REMEDY)
    rows = rows[1:] if columns.headed else rows
    kinds = {row[columns.kind].lower() for _, row in rows if columns.kind is not None and len(row) > columns.kind}
    if not kinds & set(_WORDS):
        return Alignment([word_tier(_segments(path, rows, columns, number))])
    tiers = [word_tier(_segments(path, rows, columns, number, _WORDS))]
    if kinds & set(_PHONES):
        tiers.append(phone_tier(_segments(path, rows, columns, number, _PHONES)))
    end = max(tier.end for tier in tiers)
    return Alignment(_lengthened(tier, end) for tier in tiers)


def _segments(path: Path, rows: Rows, columns: Columns, number: Callable[[str], float],
              kinds: Sequence[str] = ()) -> list[Segment]:
    """The rows of some kinds as segments one behind the other, what is between them without a name."""
    segments: list[Segment] = []
    for place, row in rows:
        if kinds and columns.kind is not None and row[columns.kind].lower() not in kinds:
            continue
        segment = _segment(path, place, row, columns, number)
        at = segments[-1].end if segments else 0.0
        if segment.start < at - TOUCH or segment.end <= at:
            raise DnnvssError(f"line {place}: {segment.label!r} starts at {segment.start:.4f} s, before {at:.4f} s",
                              file=path, remedy=_REMEDY)
        if segment.start > at + TOLERANCE:
            segments.append(Segment(at, segment.start, ""))
        segments.append(segment._replace(start=max(at, segment.start)) if segment.start < at else segment)
    if not any(s.label for s in segments):
        raise DnnvssError("holds no word", file=path, remedy=_REMEDY)
    return segments


def _segment(path: Path, place: int, row: Sequence[str], columns: Columns, number: Callable[[str], float]) -> Segment:
    try:
        start = _clock(row[columns.start], number) * columns.unit
        last = _clock(row[columns.last], number) * columns.unit
        end = start + last if columns.lasts else last
        return Tier("words", [(start, end, row[columns.word])])[0]
    except (ValueError, IndexError, DnnvssError) as error:
        why = error.problem if isinstance(error, DnnvssError) else f"{','.join(row)!r} is not START,END,WORD"
        raise DnnvssError(f"line {place}: {why}", file=path, remedy=_REMEDY) from error


def _lengthened(tier: Tier, end: float) -> Tier:
    """A tier that runs on to ``end``: a pause is made longer, or put behind it."""
    rows = list(tier)
    pause = "" if tier.name == "words" else "sil"
    if rows[-1].end < end - TOLERANCE:
        rows.append(Segment(rows[-1].end, end, pause))
    return Tier(tier.name, rows)
