"""What speech recognisers write: words or sentences and their times, in JSON of a dozen shapes."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats.cues import Cue

_REMEDY = ("Give the JSON of Whisper, WhisperX, whisper.cpp, Vosk, Deepgram, AWS, Google or AssemblyAI, or write "
           'a list [{"start": 0.5, "end": 0.9, "text": "word"}, ...]')
_LAST = 1e6  # seconds


def read_recognised(path: str | Path) -> tuple[Cue, ...]:
    """The words, or where they have no times the sentences, in a recogniser's JSON.

    Of several alternatives and channels the first counts. Known are ``segments`` with ``words``
    (Whisper, WhisperX), ``transcription`` with ``offsets`` in milliseconds (whisper.cpp), ``result``
    (Vosk, also a list of such), ``results.channels`` (Deepgram), ``results.items`` (AWS),
    ``results[].alternatives[].words`` (Google), ``words`` in milliseconds (AssemblyAI), and a plain
    list.

    Raises:
        DnnvssError: unreadable, of another shape, without words, or times that are none; names the
            file.
    """
    path = Path(path)
    data = files.read_json(path, _REMEDY)
    for shape in _SHAPES:
        try:
            found = list(shape(data))
        except (KeyError, TypeError, IndexError, AttributeError):
            continue
        if found:
            return tuple(_cue(row, path) for row in found if str(row[2]).strip())
    raise DnnvssError("holds no words with times in a shape that is known", file=path, remedy=_REMEDY)


Row = tuple[Any, Any, Any, float]
"""Start, end and text as they stand, and how many of the unit of times are a second."""


def _whisper(data: Any) -> Iterator[Row]:
    for segment in data["segments"]:
        words = segment.get("words") or []
        if words and all("start" in word and "end" in word for word in words):
            yield from ((w["start"], w["end"], w["word"], 1.0) for w in words)
        else:
            yield segment["start"], segment["end"], segment["text"], 1.0


def _whisper_cpp(data: Any) -> Iterator[Row]:
    yield from ((s["offsets"]["from"], s["offsets"]["to"], s["text"], 1000.0) for s in data["transcription"])


def _vosk(data: Any) -> Iterator[Row]:
    for part in data if isinstance(data, list) else [data]:
        yield from ((w["start"], w["end"], w["word"], 1.0) for w in part.get("result", []))


def _deepgram(data: Any) -> Iterator[Row]:
    for word in data["results"]["channels"][0]["alternatives"][0]["words"]:
        yield word["start"], word["end"], word.get("punctuated_word") or word["word"], 1.0


def _aws(data: Any) -> Iterator[Row]:
    held: Row | None = None
    for item in data["results"]["items"]:
        said = item["alternatives"][0]["content"]
        if "start_time" in item:
            if held:
                yield held
            held = item["start_time"], item["end_time"], said, 1.0
        elif held:
            held = held[0], held[1], held[2] + said, 1.0
    if held:
        yield held


def _google(data: Any) -> Iterator[Row]:
    for result in data["results"]:
        for word in result["alternatives"][0].get("words", []):
            yield (word.get("startTime", word.get("startOffset", "0s")), word.get("endTime", word.get("endOffset")),
                   word["word"], 1.0)


def _assembly(data: Any) -> Iterator[Row]:
    if all(isinstance(w["start"], int) for w in data["words"]):  # else they are seconds
        yield from ((w["start"], w["end"], w["text"], 1000.0) for w in data["words"])


def _plain(data: Any) -> Iterator[Row]:
    rows = data if isinstance(data, list) else data["words"]
    for row in rows:
        yield row["start"], row["end"], row["text"] if "text" in row else row["word"], 1.0


_SHAPES: tuple[Callable[[Any], Iterator[Row]], ...] = (
    _whisper, _whisper_cpp, _vosk, _deepgram, _aws, _google, _assembly, _plain)


def _cue(row: Row, path: Path) -> Cue:
    start, end = (_time(value, row[3]) for value in row[:2])
    text = " ".join(str(row[2]).split())
    if start is None or end is None or end < start:
        raise DnnvssError(f"{text[:40]!r} is said from {row[0]!r} to {row[1]!r}, which are no times", file=path,
                          remedy=_REMEDY)
    return Cue(start, end, text)


def _time(value: Any, unit: float) -> float | None:
    """Seconds of a number, or of a text such as ``"1.500s"``; None where it is neither."""
    if isinstance(value, str) and (match := re.fullmatch(r"(\d{1,9}(?:\.\d{1,12})?)s?", value.strip(), re.ASCII)):
        value = float(match[1])
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < _LAST * unit:
        return None
    return float(value / unit)
