"""Label files of HTK (``.lab``, ``.mlf``), times in units of 100 ns or plain seconds, and of TIMIT (``.phn``)."""

import re
from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats.htk_states import whole_phones
from dnnvss.formats.labels import is_pause, phone_tier, phones_of, word_of
from dnnvss.formats.numbers import comma_number, whole
from dnnvss.phones import SILENCES
from dnnvss.timing import Alignment, Segment, Tier

UNIT = 10_000_000
"""HTK's time units in a second."""
SAMPLES = 16_000
"""Samples in a second of TIMIT, in which its ``.phn`` count."""

_NUMBER = re.compile(r"[-+]?\d+(\.\d*)?(e[-+]?\d+)?", re.IGNORECASE)
_TIME = re.compile(r"[-+]?\d+([.,]\d*)?(e[-+]?\d+)?", re.IGNORECASE)
_LONGEST = 1e5  # seconds of a recording
_HEAD = 20
"""Lines in which the head of an ESPS label file ends."""
_REMEDY = "Write lines of START END PHONE [WORD], times in 100 ns units"
_TIMIT = "Write lines of START END PHONE, times in samples, 16,000 to the second"


def read_lab(path: str | Path) -> Alignment:
    """Return the alignment in an HTK label file, or in one of TIMIT's (``.phn``), whose whole numbers are samples.

    Lines are ``start end phone`` with times in 100 ns units, or in seconds where one of them has a decimal point. A
    fourth column that holds a number on every line is a score and is left out. Other text there, or after the score, is
    the word that begins with this phone (HTK's second level) and gives the tier ``words``; ``_`` inside it stands for a
    space. A pause without a length is left out. HTS full-context labels give the phone in their middle; lines that are
    states of one phone are that phone: a number behind the label (``[2]`` to ``[6]``, as Merlin writes them, or
    ``_s2``), ``s2`` to ``s4`` with the phone behind the first (HTK), or the same number of equal lines for every phone.
    Labels of ESPS (``END COLOUR PHONE``, seconds, below a line ``#``, as Festival and CMU ARCTIC have them) are
    read too.

    Raises:
        DnnvssError: unreadable, no line, a line that is not of this form, a gap, an overlap or an unknown phone; names
            file, line and label.
    """
    path = Path(path)
    lines = files.read_text(path, _REMEDY).splitlines()
    unit = SAMPLES if path.suffix.lower() == ".phn" else UNIT
    return _parse(path, _of_esps(lines) or list(enumerate(lines, start=1)), unit=unit)


def _of_esps(lines: list[str]) -> list[tuple[int, str]]:
    """The lines of an ESPS label file, with their numbers, as HTK would write them in seconds; none of any other."""
    mark = next((k for k, line in enumerate(lines[:_HEAD]) if line.strip() == "#"), None)
    rows = [(place, line.split(";")[0].split(maxsplit=2)) for place, line in enumerate(lines, start=1)
            if mark is not None and place > mark + 1 and line.strip()]
    if not rows or not all(len(row) == 3 and _NUMBER.fullmatch(row[0]) and row[1].lstrip("-").isdecimal()
                           for _, row in rows):
        return []
    starts = ["0.0", *(row[0] for _, row in rows)]
    return [(place, f"{float(start):.6f} {float(row[0]):.6f} {row[2]}")
            for start, (place, row) in zip(starts, rows, strict=False)]


def read_mlf(path: str | Path) -> dict[str, Alignment]:
    """Return the alignment of every utterance in an HTK master label file, by the stem of its name.

    Raises:
        DnnvssError: as :func:`read_lab`, a file without the header ``#!MLF!#``, or an utterance without its end.
    """
    path = Path(path)
    lines = files.read_text(path, _REMEDY).splitlines()
    if not lines or lines[0].strip() != "#!MLF!#":
        raise DnnvssError("line 1 is not #!MLF!#", file=path, remedy="Give a master label file, or name it .lab")
    found: dict[str, Alignment] = {}
    name, rows = "", list[tuple[int, str]]()
    for place, line in enumerate([*lines[1:], ""], start=2):
        match = re.fullmatch(r'\s*"(.*)"\s*', line)
        if (name or rows) and (match or place > len(lines)):
            raise DnnvssError(f"line {place - 1}: utterance {name!r} has no end", file=path, utterance=name or None,
                              remedy="End each utterance with a line of one dot, or get the whole file again")
        if match:
            name, rows = re.sub(r"\.\w+$", "", re.split(r"[/\\]", match.group(1))[-1]), []
        elif line.strip() == ".":
            if name in found or not name:
                raise DnnvssError(f"line {place}: utterance {name!r} ends here but is "
                                  f"{'there twice' if name else 'without a name'}", file=path,
                                  remedy="Keep one of them" if name else _REMEDY)
            found[name] = _parse(path, rows, name)
            name, rows = "", []
        elif line.strip():
            rows.append((place, line))
    return found


def write_lab(path: str | Path, alignment: Alignment) -> Path:
    """Write the tier ``phones`` as an HTK label file and return the path.

    Words stand in the fourth column, their spaces as ``_``.
    """
    return files.write_text(path, "\n".join(_lines(alignment)) + "\n")


def write_mlf(path: str | Path, alignments: dict[str, Alignment]) -> Path:
    """Write alignments by utterance id as one HTK master label file and return the path."""
    lines = ["#!MLF!#"]
    for name, alignment in alignments.items():
        lines += [f'"*/{name}.lab"', *_lines(alignment), "."]
    return files.write_text(path, "\n".join(lines) + "\n")


def _lines(alignment: Alignment) -> list[str]:
    tiers = [t for t in alignment.tiers if t.name == "words"]
    words = {round(s.start * UNIT): "_".join(s.label.split()) or "sil" for t in tiers for s in t}
    return [
        f"{round(s.start * UNIT)} {round(s.end * UNIT)} {s.label} {words.get(round(s.start * UNIT), '')}".rstrip()
        for s in alignment["phones"]
    ]


def _parse(path: Path, lines: list[tuple[int, str]], utterance: str | None = None, unit: int = UNIT) -> Alignment:
    segments, words, remedy = list[Segment](), list[tuple[float, str]](), _TIMIT if unit == SAMPLES else _REMEDY
    table = whole_phones([(place, line, line.split()) for place, line in lines if line.strip()])
    column = 4 if all(_NUMBER.fullmatch(" ".join(fields[3:4])) for *_, fields in table) else 3
    if all(" ".join(fields[column : column + 1]) == fields[2] for *_, fields in table if len(fields) > 2):
        column += 1  # HTK writes the phone of its states again
    table = [row for row in table if not _skipped(row[2], column)]
    seconds = _in_seconds([time for *_, fields in table for time in fields[:2]])
    read = phones_of(fields[2] for *_, fields in table if len(fields) > 2)
    for place, line, fields in table:
        try:
            start, end = (_seconds(x, seconds, unit) for x in fields[:2])
            segment = Tier("phones", [(start, end, fields[2])])[0]
            read(segment.label)
        except (ValueError, IndexError) as error:
            raise DnnvssError(f"line {place}: {line.strip()[:80]!r} is not START END PHONE", file=path,
                              utterance=utterance, remedy=remedy) from error
        except DnnvssError as error:
            raise type(error)(f"line {place}: {error.problem}", file=path, utterance=utterance,
                              remedy=error.remedy) from error
        if segments and abs(segment.start - segments[-1].end) > 1e-4:
            kind = "gap" if segment.start > segments[-1].end else "overlap"
            size = abs(segment.start - segments[-1].end)
            raise DnnvssError(f"line {place}: {kind} of {size:.4f} s before {fields[2]!r}", file=path,
                              utterance=utterance, remedy="Make the lines meet; write silence as a line of its own")
        segments.append(segment)
        if len(fields) > column:
            words.append((start, word_of(fields[column].replace("_", " "))))
    if not segments:
        raise DnnvssError("holds no label", file=path, utterance=utterance, remedy=remedy)
    tiers = [phone_tier(segments)]
    if words:
        tiers.append(_words(words, tiers[0]))
    return Alignment(tiers)


def _skipped(fields: list[str], column: int) -> bool:
    """Whether a line is a pause without a length: HTK passes over the ``sp`` behind a word so."""
    return 2 < len(fields) <= column and fields[0] == fields[1] and is_pause(fields[2])


def is_transcript(text: str) -> bool:
    """Whether a ``.lab`` holds words, as the Montreal Forced Aligner wants them, and no line of times."""
    timed = _timed(text)
    return bool(timed) and not any(timed)


def holds_times(text: str) -> bool:
    """Whether every line of a text begins with two times; a single line may be a sentence that begins so."""
    timed = _timed(text)
    return len(timed) > 1 and all(timed)


def _timed(text: str) -> list[bool]:
    """Whether each line that is not blank begins with two numbers."""
    lines = [line.split() for line in text.splitlines() if line.strip()]
    return [len(f) > 1 and bool(_TIME.fullmatch(f[0]) and _TIME.fullmatch(f[1])) for f in lines]


def _in_seconds(times: list[str]) -> bool:
    """Whether whole numbers among some times are seconds: where another has a decimal point, and none is too large."""
    try:
        return any("." in time or "," in time for time in times) and max(map(comma_number, times)) < _LONGEST
    except ValueError:
        return False


def _seconds(text: str, seconds: bool, unit: int) -> float:
    """A time: so many units in a second, or seconds, as one with a decimal point (comma) is anyway."""
    return comma_number(text) if seconds or "." in text or "," in text else whole(text) / unit


def _words(begins: list[tuple[float, str]], phones: Tier) -> Tier:
    """Return the words that begin at given times and end where the next word or a pause begins."""
    pauses = [(s.start, "") for s in phones if s.label in SILENCES]
    rows = sorted(dict([*pauses, *begins]).items())
    if rows[0][0] > phones.start:
        rows.insert(0, (phones.start, ""))
    ends = [start for start, _ in rows[1:]] + [phones.end]
    return Tier("words", [(start, end, word) for (start, word), end in zip(rows, ends, strict=True)])
