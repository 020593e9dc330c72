"""Subtitles as editors, players and video sites write them: SubRip and WebVTT.

**Source**: W3C, "WebVTT: The Web Video Text Tracks Format"; SubRip has no standard and is read as
players do.
"""

import html
import re
from collections.abc import Collection, Iterable
from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats.cues import Cue
from dnnvss.formats.unsaid import spoken_caption, without_names

_REMEDY = "Write each cue as a line 00:00:01,000 --> 00:00:02,500 and its text below, a blank line after it"
_STAMP = r"(-?)(?:(\d{1,3}) ?: ?)?(\d{1,2}) ?: ?(\d{1,2})(?: ?[.,] ?(\d{1,9})|:(\d{1,2}))?"
_ARROW = r"(?:[-=\u2010-\u2015\u2212]{1,2}>|[\u2192\u21d2])"
_TIMES = re.compile(rf"\s*{_STAMP}\s*{_ARROW}\s*{_STAMP}(?:\s.*)?")
_TIMED = re.compile(rf"-->|\d\s*{_ARROW}\s*-?\d|\d:\d\d[.,:]\d+.*\d:\d\d[.,:]\d")
"""What stands in a line of times alone, read or not."""
_RATES = (24, 25, 30, 50, 60, 100)
"""Frames a second in which times ``h:m:s:frame`` may count."""
_TAG = re.compile(r"<[/A-Za-z\d!][^<>]{0,200}>|\{\\[^{}]{0,200}\}")
_INSTANT = 0.1
"""Seconds in which nobody says a line again: captions that roll up hold it so long between two others."""
_NOTE = re.compile(r"(NOTE|STYLE|REGION)(\s|$)")


def read_subtitles(path: str | Path) -> tuple[Cue, ...]:
    """The cues of an ``.srt`` or ``.vtt`` file in the order of the file, without what is not spoken.

    Tags, names of speakers, sounds in brackets and songs between notes are left out, and so is a line that only
    repeats the one before it, as captions that roll up do.

    Raises:
        DnnvssError: unreadable, no cue, a cue that ends before it begins, or text where times should
            be; names file and line.
    """
    path = Path(path)
    text: str = files.read(path, lambda p: files.read_text(p, _REMEDY), _REMEDY)
    found: list[tuple[float, float, list[str]]] = []
    shown: list[str] = []
    for place, start, end, lines in _blocks(text, path):
        if end < start:
            raise DnnvssError(f"line {place}: the cue ends at {end:.3f} s, before it begins at {start:.3f} s",
                              file=path, remedy=_REMEDY)
        spoken = [line for line in _spoken(lines).split("\n") if line]
        new = [] if shown == spoken and end - start < _INSTANT else spoken[_repeated(shown, spoken):]
        shown = spoken or shown
        if new:
            found.append((start, end, new))
    if not found:
        raise DnnvssError("holds no cue with text", file=path, remedy=_REMEDY)
    bare = iter(without_names([line for _, _, lines in found for line in lines]))
    cues = (Cue(start, end, " ".join(filter(None, [next(bare) for _ in lines]))) for start, end, lines in found)
    return tuple(cue for cue in cues if cue.text)


def holds_cues(text: str) -> bool:
    """Whether a text has a line of two times, as subtitles have."""
    return any(_TIMES.fullmatch(line) for line in text.split("\n"))


def _blocks(text: str, path: Path) -> list[tuple[int, float, float, list[str]]]:
    """Line, start, end and lines of text of each cue."""
    lines = text.lstrip("\ufeff").split("\n")
    stamps = {place: match for place, line in enumerate(lines, 1) if (match := _TIMES.fullmatch(line))}
    rate = _rate(stamps.values())
    heads = _heads(lines, stamps)
    found: list[tuple[int, float, float, list[str]]] = []
    skipping, blank = lines[0].startswith("WEBVTT"), True
    for place, line in enumerate(lines, 1):
        if match := stamps.get(place):
            found.append((place, *_times(match, rate, place, path), []))
            skipping = False
        elif not line.strip():
            skipping = False
        elif skipping or (blank and _NOTE.match(line)):
            skipping = True
        elif _TIMED.search(_TAG.sub("", line)):
            raise DnnvssError(f"line {place}: {line.strip()[:60]!r} holds no two times", file=path, remedy=_REMEDY)
        elif place not in heads:
            if not found:
                raise DnnvssError(f"line {place}: {line.strip()[:60]!r} stands where times should be", file=path,
                                  remedy=_REMEDY)
            found[-1][3].append(line)
        blank = not line.strip()
    return found


def _heads(lines: list[str], stamps: Collection[int]) -> set[int]:
    """The lines, counted from 1, that are the number or the name of the cue whose times follow.

    A number may stand some blank lines above its times.
    """
    heads = set()
    for place in stamps:
        at = place - 1
        while at > 1 and not lines[at - 1].strip():
            at -= 1
        if at == place - 1 or lines[at - 1].strip().isdecimal():
            heads.add(at)
    return heads


def _rate(stamps: Iterable[re.Match[str]]) -> int:
    """Frames a second of times that count frames: the least usual rate above the largest frame."""
    most = max((int(m[k]) for m in stamps for k in (6, 12) if m[k]), default=0)
    return next(rate for rate in _RATES if rate > most)


def _times(match: re.Match[str], rate: int, place: int, path: Path) -> tuple[float, float]:
    """Start and end of a cue in seconds."""
    if match[1] or match[7]:
        raise DnnvssError(f"line {place}: {match[0].strip()[:60]!r} begins before the recording", file=path,
                          remedy="Shift the times, so that 0 is the start of the recording")
    start, end = (_seconds(match.groups()[k : k + 6], rate) for k in (0, 6))
    return start, end


def _seconds(parts: tuple[str | None, ...], rate: int) -> float:
    hours, minutes, seconds = (int(part or 0) for part in parts[1:4])
    fraction, frame = parts[4:]
    part = int(frame) / rate if frame else int(fraction or 0) / 10 ** len(fraction or "0")
    return hours * 3600 + minutes * 60 + seconds + part


def _spoken(lines: list[str]) -> str:
    """What is said of the lines of a cue."""
    bare = spoken_caption(html.unescape(_TAG.sub("", "\n".join(lines))))
    return "\n".join(" ".join(line.split()) for line in bare.split("\n"))


def _repeated(shown: list[str], lines: list[str]) -> int:
    """How many of the first lines only repeat the last ones of the cue before."""
    if shown == lines and len(lines) == 1:
        return 0  # somebody says it again
    return max((n for n in range(1, len(lines) + 1) if shown[-n:] == lines[:n]), default=0)


def write_srt(path: str | Path, cues: Iterable[Cue]) -> Path:
    """Write cues with times as SubRip and return the path."""
    blocks = [f"{k}\n{_stamp(cue.start)} --> {_stamp(cue.end)}\n{cue.text}\n" for k, cue in enumerate(cues, 1)]
    return files.write_text(path, "\n".join(blocks))


def _stamp(seconds: float | None) -> str:
    whole = round((seconds or 0.0) * 1000)
    return f"{whole // 3600000:02d}:{whole // 60000 % 60:02d}:{whole // 1000 % 60:02d},{whole % 1000:03d}"
