"""Subtitles as editors, players and video sites write them: SubRip and WebVTT.

**Source**: W3C, "WebVTT: The Web Video Text Tracks Format"; SubRip has no standard and is read as
players do.
"""

import html
import re
from collections.abc import Iterable
from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats.cues import Cue

_REMEDY = "Write each cue as a line 00:00:01,000 --> 00:00:02,500 and its text below, a blank line after it"
_STAMP = r"(?:(\d{1,3}):)?(\d{1,2}):(\d{1,2})[.,:](\d{1,3})"
_TIMES = re.compile(rf"\s*{_STAMP}\s*-{{1,2}}>\s*{_STAMP}(?:\s.*)?", re.ASCII)
_TAG = re.compile(r"<[^<>]{0,200}>|\{\\[^{}]{0,200}\}")
_SOUND = re.compile(r"\[[^\[\]]*\]|\u266a[^\u266a]*\u266a?|\u266b|^\s*[-\u2013]?\s*\([^()]*\)\s*$", re.MULTILINE)
_SPEAKER = re.compile(r"^\s*(?:>>+\s*)?(?:[-\u2013]\s+)?(?:[A-Z][A-Z .'-]{1,30}:\s+)?", re.MULTILINE)
_NOTE = re.compile(r"(NOTE|STYLE|REGION)(\s|$)")


def read_subtitles(path: str | Path) -> tuple[Cue, ...]:
    """The cues of an ``.srt`` or ``.vtt`` file in the order of the file, without what is not spoken.

    Tags, names of speakers in capitals, sounds in brackets and songs between notes are left out, and
    so is a line that only repeats the one before it, as captions that roll up do.

    Raises:
        DnnvssError: unreadable, no cue, a cue that ends before it begins, or text where times should
            be; names file and line.
    """
    path = Path(path)
    text: str = files.read(path, lambda p: files.read_text(p, _REMEDY), _REMEDY)
    cues: list[Cue] = []
    shown: list[str] = []
    for place, start, end, lines in _blocks(text, path):
        if end < start:
            raise DnnvssError(f"line {place}: the cue ends at {end:.3f} s, before it begins at {start:.3f} s",
                              file=path, remedy=_REMEDY)
        spoken = [line for line in _spoken(lines).split("\n") if line]
        new = spoken[_repeated(shown, spoken):]
        shown = spoken or shown
        if new:
            cues.append(Cue(start, end, " ".join(new)))
    if not cues:
        raise DnnvssError("holds no cue with text", file=path, remedy=_REMEDY)
    return tuple(cues)


def _blocks(text: str, path: Path) -> list[tuple[int, float, float, list[str]]]:
    """Line, start, end and lines of text of each cue."""
    lines = text.lstrip("\ufeff").split("\n")
    found: list[tuple[int, float, float, list[str]]] = []
    skipping, blank = lines[0].startswith("WEBVTT"), True
    for place, line in enumerate(lines, 1):
        if match := _TIMES.fullmatch(line):
            found.append((place, _seconds(match.groups()[:4]), _seconds(match.groups()[4:]), []))
            skipping = False
        elif not line.strip():
            skipping = False
        elif skipping or (blank and _NOTE.match(line)):
            skipping = True
        elif "-->" in line:
            raise DnnvssError(f"line {place}: {line.strip()[:60]!r} holds no two times", file=path, remedy=_REMEDY)
        elif not _heads(lines, place):
            if not found:
                raise DnnvssError(f"line {place}: {line.strip()[:60]!r} stands where times should be", file=path,
                                  remedy=_REMEDY)
            found[-1][3].append(line)
        blank = not line.strip()
    return found


def _heads(lines: list[str], place: int) -> bool:
    """Whether line ``place``, counted from 1, is the number or the name of the cue whose times follow."""
    return place < len(lines) and _TIMES.fullmatch(lines[place]) is not None


def _seconds(parts: tuple[str | None, ...]) -> float:
    hours, minutes, seconds, fraction = (part or "0" for part in parts)
    return int(hours) * 3600 + int(minutes) * 60 + int(seconds) + int(fraction.ljust(3, "0")) / 1000


def _spoken(lines: list[str]) -> str:
    """What is said of the lines of a cue."""
    bare = html.unescape(_TAG.sub("", "\n".join(lines)))
    bare = _SPEAKER.sub("", _SOUND.sub(" ", bare))
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
