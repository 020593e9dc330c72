"""Praat TextGrids, as Praat and the Montreal Forced Aligner write them."""

import re
import warnings
from pathlib import Path
from typing import Any

from praatio import textgrid

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats.labels import phone_tier, word_tier
from dnnvss.timing import Alignment, Segment, Tier

_REMEDY = "Open the file in Praat and save it again as text"
_NAMES = {"phones": ("phones", "phone", "phonemes", "segments", "mau"), "words": ("words", "word", "ort-mau")}


def read_textgrid(path: str | Path) -> Alignment:
    """Return the alignment in a TextGrid: ``phones`` and ``words`` in our labels, other interval tiers as they are.

    Tier names do not depend on case, and ``speaker - phones`` (Montreal Forced Aligner) is understood where there is
    one speaker. Either of the two tiers may be missing. Unnamed stretches are silence.

    Raises:
        DnnvssError: unreadable or cut short, no interval tier, two speakers, an unknown phone, or overlapping
            intervals; names file, tier and interval.
    """
    path = Path(path)
    grid = files.read(path, _open, _REMEDY)
    declared = _declared(path.read_bytes())
    held = [len(tier.entries) for tier in grid.tiers if isinstance(tier, textgrid.IntervalTier)]
    if any(found < wanted for wanted, found in zip(declared, held, strict=False)) or len(held) < len(declared):
        raise DnnvssError(f"is cut short: its interval tiers hold {held} intervals and say {declared}", file=path,
                          remedy="Export the alignment again")
    tiers: dict[str, Tier] = {}
    for tier in grid.tiers:
        if not isinstance(tier, textgrid.IntervalTier):
            continue
        name = _role(tier.name)
        if name in tiers:
            raise DnnvssError(f"holds two tiers of {name}, the second one is {tier.name!r}", file=path,
                              remedy="Keep one speaker a file")
        tiers[name] = _tier(path, name, tier, grid.maxTimestamp)
    if not tiers:
        raise DnnvssError("holds no interval tier", file=path, remedy="Give interval tiers named phones and words")
    return Alignment(tiers.values())


def write_textgrid(path: str | Path, alignment: Alignment) -> Path:
    """Write an alignment as a long TextGrid and return the path; silences in ``words`` are empty intervals."""
    grid = textgrid.Textgrid(alignment.start, alignment.end)
    for tier in alignment.tiers:
        edges = [alignment.start, *[s.end for s in tier][:-1], alignment.end]
        rows = list(zip(edges[:-1], edges[1:], tier.labels, strict=True))
        grid.addTier(textgrid.IntervalTier(tier.name, rows, alignment.start, alignment.end))
    with files.replacing(path) as temporary:
        grid.save(str(temporary), format="long_textgrid", includeBlankSpaces=True, minimumIntervalLength=None)
    return Path(path)


def _declared(data: bytes) -> list[int]:
    """Return how many intervals each interval tier of a long TextGrid says that it has; nothing for a short one."""
    wide = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    text = data.decode("utf-16" if wide else "utf-8", errors="replace")
    return [int(size) for size in re.findall(r"intervals: size = (\d+)", text)]


def _open(path: Path) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return textgrid.openTextgrid(str(path), includeEmptyIntervals=True, reportingMode="silence")


def _role(name: str) -> str:
    bare = re.split(r"\s+-\s+", name.strip())[-1].lower()
    return next((role for role, known in _NAMES.items() if bare in known), name)


def _tier(path: Path, name: str, tier: Any, end: float) -> Tier:
    segments: list[Segment] = []
    for number, entry in enumerate(tier.entries, start=1):
        previous = segments[-1].end if segments else 0.0
        if entry.start < previous - 1e-4:
            raise DnnvssError(f"tier {tier.name!r}: interval {number} {entry.label!r} starts at {entry.start:.4f} s, "
                              f"before the one before it ends at {previous:.4f} s", file=path, remedy=_REMEDY)
        if entry.start > previous + 1e-4:
            segments.append(Segment(previous, entry.start, ""))
        segments.append(Segment(entry.start, entry.end, entry.label))
    if not segments or segments[-1].end < end - 1e-4:
        segments.append(Segment(segments[-1].end if segments else 0.0, end, ""))
    make = {"phones": phone_tier, "words": word_tier}.get(name, lambda rows: Tier(name, rows))
    try:
        return make(segments)
    except DnnvssError as error:
        raise DnnvssError(f"tier {tier.name!r}: {error.problem}", file=path, remedy=error.remedy) from error
