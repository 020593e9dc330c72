"""What speech recognisers write: words or sentences and their times, in JSON of many shapes and in Whisper's table."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats.cues import Cue
from dnnvss.formats.numbers import number, whole
from dnnvss.formats.pace import check_cues
from dnnvss.formats.recognisers import SHAPES
from dnnvss.formats.timed_rows import Row
from dnnvss.formats.unsaid import without_remarks

_REMEDY = ("Give the JSON of Whisper, WhisperX, whisper.cpp, Vosk, Deepgram, AWS, Azure, Google, Watson, "
           "AssemblyAI, Speechmatics, Rev, Gladia, Soniox, NeMo, Gentle or the Montreal Forced Aligner, or write "
           'a list [{"start": 0.5, "end": 0.9, "text": "word"}, ...]')
_TABLE = ("Write the line start, end, text and a line a sentence, times in milliseconds, or all in seconds with a "
          "decimal point, with tabs between")
_LAST = 1e6  # seconds
_CLOCK = re.compile(r"(?:(\d{1,3}):)?(\d{1,2}):(\d{1,2}(?:[.,]\d{1,9})?)", re.ASCII)


def read_recognised(path: str | Path) -> tuple[Cue, ...]:
    """The words, or where they have no times the sentences, in a recogniser's JSON.

    Of several alternatives and channels the first counts. The shapes are those of
    :mod:`dnnvss.formats.recognisers`; a file of JSON values a line is a list of them.

    Raises:
        DnnvssError: unreadable, of another shape, without words, times that are none, or in another
            unit; names the file.
    """
    path = Path(path)
    data = files.read(path, _values, _REMEDY)
    for shape in SHAPES:
        try:
            found = list(shape(data))
        except (KeyError, TypeError, IndexError, AttributeError, ValueError, OverflowError, RecursionError):
            continue
        if found:
            spoken = ((a, b, " ".join(without_remarks(str(text)).split()), unit) for a, b, text, unit in found)
            return check_cues(tuple(_cue(row, path) for row in spoken if row[2]), path)
    raise DnnvssError("holds no words with times in a shape that is known", file=path, remedy=_REMEDY)


def read_whisper_table(path: str | Path) -> tuple[Cue, ...]:
    """The sentences in the ``.tsv`` that Whisper writes: start, end and text between tabs, in milliseconds.

    Times are seconds where all but 0 have a decimal point.

    Raises:
        DnnvssError: unreadable, a line that is not of this form, no words, or times in another unit; names file and
            line.
    """
    path = Path(path)
    rows = [(place, line, line.split("\t", 2))
            for place, line in enumerate(files.read_text(path, _TABLE).split("\n")[1:], start=2) if line.strip()]
    times = {time.strip() for *_, cells in rows for time in cells[:2]} - {"0"}
    read, unit = (number, 1.0) if times and all("." in time for time in times) else (whole, 1000.0)
    found = []
    for place, line, cells in rows:
        try:
            start, end, text = cells
            row = read(start), read(end), " ".join(without_remarks(text).split()), unit
            found.append(_cue(row, path, _TABLE))
        except ValueError as error:
            raise DnnvssError(f"line {place}: {line.strip()[:80]!r} is not START END TEXT", file=path,
                              remedy=_TABLE) from error
    if not (said := tuple(cue for cue in found if cue.text)):
        raise DnnvssError("holds no word", file=path, remedy=_TABLE)
    return check_cues(said, path)


def _values(path: Path) -> Any:
    """The JSON value in a file, or a list of those on its lines."""
    text = files.read_text(path, _REMEDY)
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        lines = [line for line in text.split("\n") if line.strip()]
        if len(lines) < 2:
            raise
        try:
            return [json.loads(line) for line in lines]
        except json.JSONDecodeError:
            return json.loads(text)  # what is wrong with the whole says more


def _cue(row: Row, path: Path, remedy: str = _REMEDY) -> Cue:
    start, end = (_time(value, row[3]) for value in row[:2])
    text = str(row[2])
    if start is None or end is None or end < start:
        raise DnnvssError(f"{text[:40]!r} is said from {row[0]!r} to {row[1]!r}, which are no times", file=path,
                          remedy=remedy)
    return Cue(start, end, text)


def _time(value: Any, unit: float) -> float | None:
    """Seconds of a number, of ``"1.500s"``, ``"0:00:01.5"``, or of seconds and nanoseconds; None where it is none."""
    if isinstance(value, Mapping) and set(value) <= {"seconds", "nanos"}:
        whole, rest = _time(value.get("seconds", 0), 1.0), _time(value.get("nanos", 0), 1e9)
        value = None if whole is None or rest is None else whole + rest
    if isinstance(value, str) and (match := re.fullmatch(r"(\d{1,9}(?:\.\d{1,12})?)s?", value.strip(), re.ASCII)):
        value = float(match[1])
    if isinstance(value, str) and (match := _CLOCK.fullmatch(value.strip())):
        hours, minutes, seconds = match.groups(default="0")
        return int(hours) * 3600 + int(minutes) * 60 + float(seconds.replace(",", "."))
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < _LAST * unit:
        return None
    return float(value / unit)
