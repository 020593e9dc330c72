"""Which recordings are long, told by what lies beside them and how long they last."""

from pathlib import Path

from data_prep.shelf import Shelf
from dnnvss import files
from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.formats import TIMED, is_words_csv, read_alignment
from dnnvss.media.index import seconds_of

LONG, MANY = 60.0, 40
"""Seconds from which a recording with more words than that in its transcript is cut into utterances."""


def long_script(shelf: Shelf, name: str, video: Path | None) -> tuple[Path, str] | None:
    """The file that tells what is said in a recording that is to be cut, and why; None for a clip of one utterance.

    It is cut where subtitles or a recogniser's words lie beside it and no transcript, and where it lasts longer than a
    minute and has a transcript of more than 40 words, or a TextGrid of words alone.
    """
    if video is None:
        return None
    timed, transcript = _timed(shelf, name), shelf.get(name, ".txt", ".lab")
    if transcript is None and timed is not None and timed.suffix.lower() != ".textgrid":
        return timed, f"beside it lies {timed.name}"
    words = len(_text(transcript).split()) if transcript is not None else 0
    script = timed or transcript
    if script is None or (transcript is not None and words <= MANY):
        return None
    try:
        seconds = seconds_of(video)
    except DnnvssError:
        return None  # what reads it will say why
    return (script, f"longer than {LONG:g} s") if seconds > LONG else None


def _timed(shelf: Shelf, name: str) -> Path | None:
    """What tells when words of a recording are said."""
    if (found := shelf.get(name, *TIMED)) is not None:
        return found
    for table in (shelf.get(name, ".csv"), shelf.get(name, ".tsv")):
        if table is not None and is_words_csv(table):
            return table
    return next((path for path in (shelf.get(name, ".textgrid"), shelf.get(name, ".ctm")) if has_tier(path, "words")),
                None)


def has_tier(path: Path | None, tier: str) -> bool:
    """Whether an alignment that can be read has a tier."""
    try:
        return path is not None and tier in read_alignment(path, path.stem)
    except ShortageError:
        raise
    except DnnvssError:
        return False  # what reads it will say why


def _text(path: Path) -> str:
    try:
        return files.read_text(path, "Write the words of the recording there")
    except DnnvssError:
        return ""
