"""Rows with a start, an end and a text, wherever in a JSON value they stand."""

import re
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

Row = tuple[Any, Any, Any, float]
"""Start, end and text as they stand, and how many of the unit of times are a second."""

_STARTS = ("start", "begin", "starttime", "begintime", "timebegin", "timestart", "from")
_ENDS = ("end", "stop", "endtime", "stoptime", "timeend", "to")
_OFFSETS = ("startoffset", "endoffset")
"""Times of Google where they are texts or objects; as numbers they are frames of NeMo, and no times."""
_SPANS = ("timestamp", "timestamps", "offsets", "time")
"""Both times in one, as a pair or as an object."""
_TEXTS = ("punctuated_word", "text", "word", "label", "Word", "Text", "content", "transcript", "transcription",
          "sentence", "segment", "token")
_FINEST = ("words", "word", "word_segments", "tokens", "segments", "segment", "sentences", "utterances")
"""Names of lists, the finest that are words first."""
_OTHERS = ("char", "chars", "entities", "chapters", "topics", "translation", "translations", "translated_utterances")
"""Names of what has times and is not what was said, or is smaller than a word."""
_OF_SEVERAL = ("alternatives", "channels")
_NO_WORDS = ("spacing", "audio_event")
"""Types of what stands between words."""
_MARK = re.compile(r"\s*<\w+>\s*")


def timed_rows(data: Any) -> Iterator[Row]:
    """The rows of the finest list with times: of words where there is one, otherwise of sentences.

    Of several alternatives and channels the first counts. Times are counted in milliseconds where their names say so
    (``start_ms``), and whole numbers of ``utterances`` are (AssemblyAI). A word without times is said with the one
    before it.
    """
    rows = _rows(data, "")
    held: Row | None = None
    before = ""
    for row, after in pairwise([*rows, None]):
        assert row is not None
        if row[0] is None:
            before = f"{before} {row[2]}".strip()
            end = after[0] if after and after[0] is not None else None
            if held:
                held = held[0], held[1] if end is None else end, f"{held[2]} {row[2]}", held[3]
                before = ""
            continue
        if held:
            yield held
        held, before = (row[0], row[1], f"{before} {row[2]}" if before else row[2], row[3]), ""
    if held:
        yield held


def _rows(value: Any, name: str) -> list[Row]:
    """The rows below a value that stands under a name; those of words without times have none."""
    if isinstance(value, dict):
        order = sorted((n for n in value if n not in _OTHERS),
                       key=lambda n: _FINEST.index(n) if n in _FINEST else len(_FINEST))
        return next((rows for n in order if (rows := _rows(value[n], n))), [])
    if not isinstance(value, list):
        return []
    items = [item for item in (value[:1] if name in _OF_SEVERAL else value) if isinstance(item, dict)]
    if name not in ("", *_FINEST):  # labels are of anything then
        items = [{key: inner for key, inner in item.items() if key != "label"} for item in items]
    if not any(_is_row(item) for item in items):
        return [row for item in items for row in _rows(item, name)]
    found = [row for item in items if item.get("type") not in _NO_WORDS and not _is_translated(item)
             for row in _finer(item, name)]
    if name == "utterances" and all(isinstance(time, int) for row in found for time in row[:2] if time is not None):
        found = [(start, end, text, 1000.0) for start, end, text, _ in found]
    return _whole_words(found) if name == "tokens" else found


def _finer(item: dict[str, Any], name: str) -> list[Row]:
    """The words of an item, or where it has none the item itself."""
    finer = next((rows for n in _FINEST if n != name and (rows := _rows(item.get(n), n))), [])
    (start, unit), (end, _), text = _time_of(item, _STARTS), _end_of(item), _text_of(item)
    return finer or ([(start, end, text, unit)] if text is not None else [])


def _whole_words(tokens: list[Row]) -> list[Row]:
    """Words of the pieces that begin with a space where a word begins."""
    if not any(row[2].startswith(" ") for row in tokens):
        return tokens
    found = list[Row]()
    for start, end, text, unit in tokens:
        if found and not text.startswith(" ") and not _MARK.fullmatch(text):
            found[-1] = found[-1][0], found[-1][1] if end is None else end, found[-1][2] + text, unit
        elif not _MARK.fullmatch(text):
            found.append((start, end, text, unit))
    return found


def _is_row(item: dict[str, Any]) -> bool:
    return _time_of(item, _STARTS)[0] is not None and _end_of(item)[0] is not None and _text_of(item) is not None


def _is_translated(item: dict[str, Any]) -> bool:
    return item.get("translation_status") == "translation"


def _text_of(item: dict[str, Any]) -> str | None:
    return next((item[name] for name in _TEXTS if isinstance(item.get(name), str)), None)


def _end_of(item: dict[str, Any]) -> tuple[Any, float]:
    """When an item ends, by its end or by how long it lasts; None where neither is told."""
    end, unit = _time_of(item, _ENDS)
    start, lasts = _time_of(item, _STARTS)[0], item.get("duration")
    if end is None and isinstance(start, int | float) and isinstance(lasts, int | float):
        return start + lasts, unit
    return end, unit


def _time_of(item: dict[str, Any], names: tuple[str, ...]) -> tuple[Any, float]:
    """The time under one of some names, however they are spelt, and its units in a second; None where there is none."""
    plain = {re.sub(r"[_ -]", "", name).lower(): value for name, value in item.items()}
    for name in names:
        for spelt, unit in ((name, 1.0), (f"{name}ms", 1000.0), (f"{name}inms", 1000.0)):
            if plain.get(spelt) is not None:
                return plain[spelt], unit
    offset = plain.get(_OFFSETS[names is _ENDS])
    if isinstance(offset, str | dict):
        return offset, 1.0
    for span in (plain.get(name) for name in _SPANS):
        if isinstance(span, dict) and not set(span) <= {"seconds", "nanos"}:
            return _time_of(span, names)
        if isinstance(span, list) and len(span) == 2 and not any(isinstance(time, list) for time in span):
            return span[names is _ENDS], 1.0
    return None, 1.0
