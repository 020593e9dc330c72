"""Which recordings are long, told by what lies beside them and how long they last."""

from pathlib import Path

from data_prep.shelf import Shelf
from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats import TIMED, is_words_csv, read_textgrid
from dnnvss.media.index import seconds_of

LONG, MANY = 60.0, 40
"""Seconds from which a recording with more words than that in its transcript is cut into utterances."""


def long_script(shelf: Shelf, name: str, video: Path | None) -> tuple[Path, str] | None:
    """The file that tells what is said in a recording that is to be cut, and why; None for a clip of one utterance.

    It is cut where times of words or subtitles lie beside it and no transcript, and where it has a transcript
    of more than 40 words and lasts longer than a minute.
    """
    timed, transcript = _timed(shelf, name), shelf.get(name, ".txt")
    if video is None:
        return None
    if transcript is None:
        beside = shelf.get(name, ".lab") is None and timed is not None
        return (timed, f"beside it lies {timed.name}") if timed is not None and beside else None
    if len(_text(transcript).split()) <= MANY:
        return None
    try:
        seconds = seconds_of(video)
    except DnnvssError:
        return None  # what reads it will say why
    return (timed or transcript, f"longer than {LONG:g} s") if seconds > LONG else None


def _timed(shelf: Shelf, name: str) -> Path | None:
    """What tells when words of a recording are said."""
    if (found := shelf.get(name, *TIMED)) is not None:
        return found
    table = shelf.get(name, ".csv")
    if table is not None and is_words_csv(table):
        return table
    grid = shelf.get(name, ".textgrid")
    return grid if grid is not None and _has_words(grid) else None


def _has_words(grid: Path) -> bool:
    try:
        return "words" in read_textgrid(grid)
    except DnnvssError:
        return False  # what reads it will say why


def _text(path: Path) -> str:
    try:
        return files.read_text(path, "Write the words of the recording there")
    except DnnvssError:
        return ""
