"""Word times as a table for spreadsheets."""

import csv
import io
from pathlib import Path

from dnnvss import files
from dnnvss.timing import Alignment


def write_words_csv(path: str | Path, alignment: Alignment) -> Path:
    """Write the words as CSV with the columns start, end (seconds) and word, pauses left out; return the path."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["start", "end", "word"])
    writer.writerows([f"{s.start:.4f}", f"{s.end:.4f}", s.label] for s in alignment["words"] if s.label)
    return files.write_text(path, text.getvalue())
