"""Word times as a table for spreadsheets."""

import csv
import io
from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats.labels import word_tier
from dnnvss.formats.rows import table_rows
from dnnvss.timing import Alignment, Segment, Tier
from dnnvss.timing.tiers import TOLERANCE


def write_words_csv(path: str | Path, alignment: Alignment) -> Path:
    """Write the words as CSV with the columns start, end (seconds) and word, pauses left out; return the path."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["start", "end", "word"])
    writer.writerows([f"{s.start:.4f}", f"{s.end:.4f}", s.label] for s in alignment["words"] if s.label)
    return files.write_text(path, text.getvalue())


def read_words_csv(path: str | Path) -> Tier:
    """The tier ``words`` of a CSV with the columns start, end (seconds) and word; what is between is ``""``.

    Cells may be parted by semicolons or tabs, and numbers then have decimal commas.

    Raises:
        DnnvssError: unreadable, another header, no word, a row that is not of this form, or words that overlap; names
            file and line.
    """
    path = Path(path)
    remedy = "Write the header start,end,word and a line a word, times in seconds"
    rows, number = files.read(path, lambda p: table_rows(files.read_text(p, remedy)), remedy)
    if not rows or [name.lower() for name in rows[0][1]] != ["start", "end", "word"]:
        raise DnnvssError(f"line {rows[0][0] if rows else 1} is not start,end,word", file=path, remedy=remedy)
    segments: list[Segment] = []
    for place, row in rows[1:]:
        try:
            start, end, word = row
            segment = Tier("words", [(number(start), number(end), word)])[0]
        except (ValueError, DnnvssError) as error:
            why = error.problem if isinstance(error, DnnvssError) else f"{','.join(row)!r} is not START,END,WORD"
            raise DnnvssError(f"line {place}: {why}", file=path, remedy=remedy) from error
        at = segments[-1].end if segments else 0.0
        if segment.start < at - TOLERANCE:
            raise DnnvssError(f"line {place}: {word!r} starts at {segment.start:.4f} s, before {at:.4f} s", file=path,
                              remedy=remedy)
        if segment.start > at + TOLERANCE:
            segments.append(Segment(at, segment.start, ""))
        segments.append(segment)
    if not segments:
        raise DnnvssError("holds no word", file=path, remedy=remedy)
    return word_tier(segments)
