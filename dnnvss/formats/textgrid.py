"""Praat TextGrids, as Praat and the Montreal Forced Aligner write them."""

import re
from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats.labels import phone_tier, word_tier
from dnnvss.formats.praat import BINARY, CutShortError, PraatGrid, PraatTier, parse_binary, parse_text
from dnnvss.timing import Alignment, Segment, Tier

_REMEDY = "Open the file in Praat and save it again as text"
_EARLY = 0.1
"""Seconds by which an interval may begin before the sound: so much of it is cut off."""
_NAMES = {"phones": ("phones", "phone", "phonemes", "phoneme", "phn", "segments", "segment", "mau"),
          "words": ("words", "word", "wrd", "ort-mau")}


def read_textgrid(path: str | Path) -> Alignment:
    """The alignment in a TextGrid: ``phones`` and ``words`` in our labels, other interval tiers as they are.

    Praat's long, short and binary forms are read. Tier names do not depend on case, and ``speaker - phones`` (Montreal
    Forced Aligner) is understood where there is one speaker. Either of the two tiers may be missing. Unnamed stretches
    are silence.

    Raises:
        DnnvssError: unreadable or cut short, no interval tier, two speakers, an unknown phone, overlapping intervals,
            or one that begins more than a tenth of a second before the sound; names file, tier and interval.
    """
    path = Path(path)
    grid: PraatGrid = files.read(path, _open, _REMEDY)
    tiers: dict[str, Tier] = {}
    for tier in grid.tiers:
        name = _role(tier.name)
        if name in tiers:
            raise DnnvssError(f"holds two tiers of {name}, the second one is {tier.name!r}", file=path,
                              remedy="Keep one speaker a file")
        tiers[name] = _tier(path, name, tier, grid.end)
    if not tiers:
        raise DnnvssError("holds no interval tier", file=path, remedy="Give interval tiers named phones and words")
    return Alignment(tiers.values())


def write_textgrid(path: str | Path, alignment: Alignment) -> Path:
    """Write an alignment as a long TextGrid and return the path; silences in ``words`` are empty intervals."""
    from praatio import textgrid  # slow to import

    grid = textgrid.Textgrid(alignment.start, alignment.end)
    for tier in alignment.tiers:
        edges = [alignment.start, *[s.end for s in tier][:-1], alignment.end]
        rows = list(zip(edges[:-1], edges[1:], tier.labels, strict=True))
        grid.addTier(textgrid.IntervalTier(tier.name, rows, alignment.start, alignment.end))
    with files.replacing(path) as temporary:
        grid.save(str(temporary), format="long_textgrid", includeBlankSpaces=True, minimumIntervalLength=None)
    return Path(path)


def _open(path: Path) -> PraatGrid:
    with path.open("rb") as file:
        begins = file.read(len(BINARY))
    try:
        return parse_binary(path.read_bytes()) if begins == BINARY else parse_text(files.read_text(path, _REMEDY))
    except CutShortError as error:
        raise DnnvssError("is cut short", file=path, remedy="Export the alignment again") from error


def _role(name: str) -> str:
    bare = re.split(r"\s+-\s+", name.strip())[-1].lower()
    return next((role for role, known in _NAMES.items() if bare in known), name)


def _tier(path: Path, name: str, tier: PraatTier, end: float) -> Tier:
    segments: list[Segment] = []
    for number, (start, stop, text) in enumerate(tier.rows, start=1):
        label, previous = text.strip(), segments[-1].end if segments else 0.0
        if start < -_EARLY:
            raise DnnvssError(f"tier {tier.name!r}: interval {number} {label!r} starts at {start:.4f} s, before the "
                              "sound does", file=path, remedy="Give times that count from the beginning of the sound")
        if stop <= 0:
            continue
        start = max(start, 0.0)
        if start < previous - 1e-4:
            raise DnnvssError(f"tier {tier.name!r}: interval {number} {label!r} starts at {start:.4f} s, "
                              f"before the one before it ends at {previous:.4f} s", file=path, remedy=_REMEDY)
        if start > previous + 1e-4:
            segments.append(Segment(previous, start, ""))
        segments.append(Segment(start, stop, label))
    if not segments or segments[-1].end < end - 1e-4:
        segments.append(Segment(segments[-1].end if segments else 0.0, end, ""))
    make = {"phones": phone_tier, "words": word_tier}.get(name, lambda rows: Tier(name, rows))
    try:
        return make(segments)
    except DnnvssError as error:
        raise type(error)(f"tier {tier.name!r}: {error.problem}", file=path, remedy=error.remedy) from error
