"""Reading and writing an alignment by the suffix of its file."""

from collections.abc import Callable, Collection, Mapping
from functools import lru_cache
from pathlib import Path

from dnnvss.errors import DnnvssError
from dnnvss.formats.ctm import read_ctm
from dnnvss.formats.grid import read_grid_align, write_grid_align
from dnnvss.formats.htk import read_lab, read_mlf, write_lab, write_mlf
from dnnvss.formats.labels import word_of
from dnnvss.formats.pace import check_pace
from dnnvss.formats.textgrid import read_textgrid, write_textgrid
from dnnvss.formats.words import read_words_csv, write_words_csv
from dnnvss.phones import SILENCE, SILENCES
from dnnvss.timing import Alignment, Segment, Tier

_KNOWN = "Use .TextGrid, .lab (HTK), .mlf (HTK), .phn (TIMIT), .ctm (NIST), .csv (words) or .align (GRID)"


def read_alignment(path: str | Path, utterance: str | None = None) -> Alignment:
    """Return the alignment in a ``.TextGrid``, ``.lab``, ``.mlf``, ``.phn``, ``.ctm``, ``.csv`` or ``.align`` file.

    Args:
        path: the file.
        utterance: the id to take from an ``.mlf`` or ``.ctm``; not needed if it holds one utterance.

    Raises:
        DnnvssError: another suffix, a damaged file, times in another unit than the format's, or an ``.mlf`` or ``.ctm``
            that does not hold the utterance.
    """
    path = Path(path)
    return check_pace(_read(path, utterance), path)


def _read(path: Path, utterance: str | None) -> Alignment:
    match path.suffix.lower():
        case ".textgrid":
            return read_textgrid(path)
        case ".lab" | ".phn":
            return read_lab(path)
        case ".align":
            return Alignment([read_grid_align(path)])
        case ".csv":
            return read_words_csv(path)
        case ".mlf":
            return _one(_utterances(path), path, utterance)
        case ".ctm":
            found = _utterances(path)
            return _one(found, path, utterance if len(found) > 1 else None)
    raise DnnvssError(f"alignments of the kind {path.suffix!r} are not understood", file=path, remedy=_KNOWN)


def with_phones(path: Path) -> Collection[str]:
    """The utterances of an ``.mlf`` or ``.ctm`` of many whose phone times it holds; raises as its reader does."""
    return {name for name, alignment in _utterances(path).items() if "phones" in alignment}


def _utterances(path: Path) -> Mapping[str, Alignment]:
    """The alignments of a file of many by the name of the utterance."""
    return _read_all(path, path.stat().st_mtime_ns if path.is_file() else 0)


@lru_cache(maxsize=2)
def _read_all(path: Path, changed: int) -> Mapping[str, Alignment]:
    """A file of a whole corpus is read once and not for every utterance."""
    return read_mlf(path) if path.suffix.lower() == ".mlf" else read_ctm(path)


def _one(found: Mapping[str, Alignment], path: Path, utterance: str | None) -> Alignment:
    """The alignment of an utterance among those of a file; that of the only one where none is named."""
    if utterance is None and len(found) == 1:
        return next(iter(found.values()))
    if utterance is not None and utterance in found:
        return found[utterance]
    raise DnnvssError(f"holds {len(found)} utterances, not {utterance!r}", file=path,
                      remedy=f"Name one of them, e.g. {next(iter(found), 'none is there')}")


_WRITERS: Mapping[str, Callable[[Path, Alignment], Path]] = {
    ".textgrid": write_textgrid,
    ".lab": write_lab,
    ".mlf": lambda path, alignment: write_mlf(path, {path.stem: alignment}),
    ".csv": write_words_csv,
    ".align": lambda path, alignment: write_grid_align(path, alignment["words"]),
}
"""How an alignment is written, by suffix."""


def check_alignment_file(path: str | Path) -> None:
    """Refuse the name of a file that no alignment is written as.

    Raises:
        DnnvssError: another suffix.
    """
    if (suffix := Path(path).suffix).lower() not in _WRITERS:
        raise DnnvssError(f"alignments of the kind {suffix!r} cannot be written", file=path,
                          remedy="Use .TextGrid, .lab (HTK), .mlf (HTK), .csv (words) or .align (GRID)")


def write_alignment(path: str | Path, alignment: Alignment) -> Path:
    """Write an alignment in the format that the suffix names (``.csv`` holds the words) and return the path.

    Raises:
        DnnvssError: another suffix.
    """
    check_alignment_file(path)
    path = Path(path)
    return _WRITERS[path.suffix.lower()](path, alignment)


def spanning(alignment: Alignment, duration: float, tolerance: float = 0.1) -> Alignment:
    """Return the alignment with every tier running from 0 to ``duration`` seconds: silence is added or cut at the ends.

    In the tier ``visemes``, which has no name for silence, the first and the last unit are made longer or shorter.
    Speech that ends up to ``tolerance`` seconds after the recording is cut back to it.

    Raises:
        DnnvssError: the alignment begins before 0, or its speech runs past the recording by more than ``tolerance``.
    """
    return Alignment(_span(tier, duration, tolerance) for tier in alignment.tiers)


def _span(tier: Tier, duration: float, tolerance: float) -> Tier:
    units = tier.name == "visemes"
    pause = SILENCE if tier.name == "phones" else ""
    rows = list(tier)
    spoken = [] if units else [s for s in rows if s.label not in SILENCES and word_of(s.label)]
    if rows[0].start < -1e-4 or (spoken and (spoken[-1].end > duration + tolerance or spoken[-1].start >= duration)):
        raise DnnvssError(
            f"tier {tier.name!r} has speech from {rows[0].start:.3f} to {(spoken or rows)[-1].end:.3f} s, "
            f"but the recording runs from 0 to {duration:.3f} s",
            remedy="Give the alignment that belongs to this recording",
        )
    rows = [s._replace(end=min(s.end, duration)) for s in rows if s.start < duration - 1e-4]
    if rows[0].start > 1e-4 and not units and not _silent(rows[0], pause):
        rows.insert(0, Segment(0.0, rows[0].start, pause))
    if rows[-1].end < duration - 1e-4 and not units and not _silent(rows[-1], pause):
        rows.append(Segment(rows[-1].end, duration, pause))
    rows[0] = rows[0]._replace(start=0.0)
    rows[-1] = rows[-1]._replace(end=duration)
    return Tier(tier.name, rows)


def _silent(segment: Segment, pause: str) -> bool:
    return segment.label == pause or (pause == SILENCE and segment.label in SILENCES)
