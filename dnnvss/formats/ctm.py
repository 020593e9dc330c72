"""Times of words or phones as speech recognisers score them: NIST's CTM, of Kaldi, NeMo and the Montreal aligner.

**Source**: NIST, "RT-09 Evaluation Plan", appendix on CTM; lines of ``file channel start duration label [confidence
[type [speaker]]]``, times in seconds, remarks behind ``;;``.
"""

import re
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats.labels import PLACE, phone_tier, word_of, word_tier
from dnnvss.formats.numbers import number
from dnnvss.formats.words import TOUCH
from dnnvss.phones import SPOKEN, VOWELS, strip_stress
from dnnvss.timing import Alignment, Segment
from dnnvss.timing.tiers import TOLERANCE

_REMEDY = "Write lines of FILE CHANNEL START DURATION LABEL, times in seconds"
_MARK = re.compile(r"<.*>|\[.*\]|\{.*\}|@")
"""What is no word: ``<unk>``, ``[noise]``, ``<ALT_BEGIN>``, a deletion."""
_SOUNDS = ("non-lex", "misc")
"""Types of what is heard and is no word: coughs, breaths, noise."""
_CLOSE = 0.0151
"""Seconds between neighbours that are a rounding and no pause."""
_LEAST = 0.01
"""Seconds of a label without a length, which aligners by frames give to what they pass over."""
_PHONETIC = 0.8
"""Share of labels that are phones from which all are."""


class _Row(NamedTuple):
    """A line: its number, channel, start and end in seconds, and label."""

    place: int
    channel: str
    start: float
    end: float
    label: str


def read_ctm(path: str | Path) -> dict[str, Alignment]:
    """The alignment of every recording in a CTM file, by its name there without folder and suffix.

    Labels are phones where four fifths of all are ARPAbet, with stress and Kaldi's places in the word or without, and
    words otherwise. Lines are put in the order of their times, and edges that differ by a rounding are made one.

    Raises:
        DnnvssError: unreadable, no label, a line that is not of this form, numbers of phones in place of their names,
            two channels of one recording, an overlap, or an unknown phone; names file, recording and line.
    """
    path = Path(path)
    rows: dict[str, list[_Row]] = {}
    for place, line in enumerate(files.read_text(path, _REMEDY).split("\n"), start=1):
        if fields := line.split(";;")[0].split():
            name, row = _row(path, place, line, fields)
            rows.setdefault(name, []).append(row)
    labels = [row.label for found in rows.values() for row in found]
    if not any(word_of(label) for label in labels):
        raise DnnvssError("holds no label", file=path, remedy=_REMEDY)
    if all(label.isdecimal() for label in labels):
        raise DnnvssError("its labels are numbers, and no phones or words", file=path,
                          remedy="Write their names there: utils/int2sym.pl -f 5 phones.txt")
    phones = _phonetic(labels)
    return {name: _alignment(path, name, found, phones) for name, found in rows.items()}


def _row(path: Path, place: int, line: str, fields: list[str]) -> tuple[str, _Row]:
    try:
        start, lasts = (number(field) for field in fields[2:4])
        if start < 0 or lasts < 0:
            raise ValueError(line)
        label = "" if fields[6:7] and fields[6].lower() in _SOUNDS else fields[4]
    except (ValueError, IndexError) as error:
        raise DnnvssError(f"line {place}: {line.strip()[:80]!r} is not FILE CHANNEL START DURATION LABEL", file=path,
                          remedy=_REMEDY) from error
    name = re.sub(r"\.(wav|flac|sph|mp3|mp4)$", "", PurePosixPath(fields[0]).name, flags=re.IGNORECASE)
    return name, _Row(place, fields[1], start, start + lasts, label)


def _phonetic(labels: Iterable[str]) -> bool:
    """Whether labels are phones: nearly all are ARPAbet or have Kaldi's place in the word, with a vowel."""
    spoken = [label for label in labels if word_of(label) and not _MARK.match(label)]
    bare = [strip_stress(PLACE.sub("", label).upper()) for label in spoken]
    known = sum(phone in SPOKEN or bool(PLACE.search(label)) for phone, label in zip(bare, spoken, strict=True))
    return known >= _PHONETIC * len(bare) and not set(VOWELS).isdisjoint(bare)


def _alignment(path: Path, name: str, rows: list[_Row], phones: bool) -> Alignment:
    channels = list(dict.fromkeys(row.channel for row in rows))
    if len(channels) > 1:
        raise DnnvssError(f"holds the channels {' and '.join(channels[:3])} of one recording", file=path,
                          utterance=name, remedy="Keep the lines of one speaker")
    rows = sorted(rows, key=lambda row: row.start)
    if not phones:
        rows = [row._replace(label="" if _MARK.fullmatch(row.label) else row.label) for row in rows]
    segments: list[Segment] = []
    for row, after in pairwise([*rows, None]):
        assert row is not None
        start, end = row.start, row.end
        at = segments[-1].end if segments else 0.0
        if start < at - TOUCH:
            raise DnnvssError(f"line {row.place}: {row.label!r} starts at {start:.3f} s, before {at:.3f} s, where the "
                              "one before it ends", file=path, utterance=name, remedy=_REMEDY)
        if after is not None and abs(after.start - end) < _CLOSE:
            end = after.start
        if start > at + TOLERANCE:
            segments.append(Segment(at, start, ""))
            at = start
        if (end := max(end, at + _LEAST) if word_of(row.label) else end) > at:
            segments.append(Segment(at, end, row.label))
    try:
        return Alignment([phone_tier(segments) if phones else word_tier(segments)])
    except DnnvssError as error:
        raise type(error)(error.problem, file=path, utterance=name, remedy=error.remedy) from error
