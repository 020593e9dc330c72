"""Text files that are something else than the words of a recording: told by how they begin, or by all their lines."""

import json
import re
from typing import NamedTuple


class Kind(NamedTuple):
    """What a file is, in words, and the suffix of its kind where it is read under that; else empty."""

    name: str
    suffix: str = ""


_BEGINS = {
    "{\\rtf": Kind("RTF"), "<!doctype": Kind("HTML"), "<html": Kind("HTML"), "%pdf": Kind("PDF"),
    "<?xml": Kind("XML"), "<tt": Kind("XML"), "<transcript": Kind("XML"), "<timedtext": Kind("XML"),
    "<sami": Kind("SAMI"), "[script info]": Kind("SubStation Alpha"), "@utf8": Kind("CHAT"), "@begin": Kind("CHAT"),
    "webvtt": Kind("WebVTT", ".vtt"), "#!mlf!#": Kind("an HTK master label file", ".mlf"),
    'file type = "ootextfile': Kind("a TextGrid", ".TextGrid"), '"praat chron': Kind("a TextGrid of Praat's log"),
}
"""How files begin, in lower case, and what they are."""
_NUMBER = r"\d{1,6}(?:[.,]\d{1,9})?"
_TIME = rf"(?:\d{{1,2}}:)?\d{{1,2}}:{_NUMBER}|{_NUMBER}"
_LINES = (
    (re.compile(r"[*@%][A-Za-z]{2,7}\d?:\s.*|@\w+.*"), Kind("CHAT")),
    (re.compile(rf"(?:[^\t]*\t){{1,4}}(?:{_TIME})\t+(?:{_TIME})\t.*"), Kind("a table of times")),
    (re.compile(r"\S+ +\S+ +(?:\S+ +)?\d+\.\d+ +\d+\.\d+ +\S.*"), Kind("a table of times")),
)
"""What each line of a file is like, and what the file is."""
_FIRST = (
    (re.compile(r"\d{1,2}:\d\d:\d\d\.\d{3},\d{1,2}:\d\d:\d\d\.\d{3}"), Kind("captions of YouTube (SBV)")),
)
"""What the first line of a file is like, and what the file is."""


def kind_of(text: str) -> Kind | None:
    """What a text is that was given the name of a transcript; None where it may be one."""
    text = text.lstrip("\ufeff \t\n")
    begins = text[:30].lower()
    lines = [line.strip() for line in text.split("\n") if line.strip()]
    found = [kind for mark, kind in _BEGINS.items() if begins.startswith(mark)]
    found += [Kind("JSON", ".json")] * _is_json(text)
    found += [kind for pattern, kind in _FIRST if lines and pattern.fullmatch(lines[0])]
    found += [kind for pattern, kind in _LINES if lines and all(map(pattern.fullmatch, lines))]
    return next(iter(found), None)


def _is_json(text: str) -> bool:
    """Whether a text is an object or a list of JSON, or one on each line."""
    return text[:1] in ("{", "[") and (_parses(text) or all(_parses(line) for line in text.split("\n") if line.strip()))


def _parses(text: str) -> bool:
    try:
        return isinstance(json.loads(text), dict | list)
    except (ValueError, RecursionError):
        return False
