"""Word times as the GRID corpus gives them: ``start end word`` a line, 25,000 units a second."""

from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats.labels import word_tier
from dnnvss.formats.numbers import comma_number
from dnnvss.timing import Segment, Tier

UNIT = 25_000
"""Units in a second (the sound of the corpus was sampled at 25 kHz)."""

_REMEDY = "Write lines of START END WORD, times in units of 1/25000 s"


def read_grid_align(path: str | Path, unit: float = UNIT) -> Tier:
    """Return the tier ``words`` of a GRID ``.align`` file, in seconds; ``sil`` and ``sp`` are ``""``.

    Args:
        path: the file.
        unit: units in a second; some copies of the corpus count video frames (1000 a frame of 25 a second: the same).

    Raises:
        DnnvssError: unreadable, no word, a line that is not of this form, a gap or an overlap; names file and line.
    """
    path = Path(path)
    segments = list[Segment]()
    lines = files.read_text(path, _REMEDY).splitlines()
    for place, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        fields = line.split()
        try:
            start, end = (comma_number(field) / unit for field in fields[:2])
            segment = Segment(start, end, " ".join([fields[2], *fields[3:]]))
            Tier("words", [*segments[-1:], segment])
        except (ValueError, IndexError, DnnvssError) as error:
            why = error.problem if isinstance(error, DnnvssError) else f"{line.strip()!r} is not START END WORD"
            raise DnnvssError(f"line {place}: {why}", file=path, remedy=_REMEDY) from error
        segments.append(segment)
    if not segments:
        raise DnnvssError("holds no word", file=path, remedy=_REMEDY)
    return word_tier(segments)


def write_grid_align(path: str | Path, words: Tier, unit: float = UNIT) -> Path:
    """Write a tier of words as ``.align`` file and return the path; pauses are ``sil`` at the ends, ``sp`` inside."""
    last = len(words) - 1
    lines = [
        f"{round(s.start * unit)} {round(s.end * unit)} {s.label or ('sil' if i in (0, last) else 'sp')}"
        for i, s in enumerate(words)
    ]
    return files.write_text(path, "\n".join(lines) + "\n")
