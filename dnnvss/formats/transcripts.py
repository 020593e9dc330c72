"""Whether a text file is the words of a recording, and not something that was given its name."""

from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats.htk import holds_times
from dnnvss.formats.other_kinds import kind_of
from dnnvss.formats.stamped_text import stamped_cues
from dnnvss.formats.subtitles import holds_cues
from dnnvss.formats.unsaid import left_out, spoken_lines
from dnnvss.formats.words import is_words_csv

_WORDS = "Write the words of the recording there"


def plain_text(path: Path, utterance: str | None = None) -> str:
    """The text of a file of words, with times in its lines or without.

    Raises:
        DnnvssError: it cannot be read, or is something else: subtitles, a TextGrid, JSON, RTF, HTML, a table of times.
    """
    text = files.read_text(path, _WORDS)
    if (kind := kind_of(text)) is not None:
        renamed = f"Rename it {path.stem}{kind.suffix}, or write the words alone there"
        raise DnnvssError(f"is {kind.name}, and no plain text", file=path, utterance=utterance,
                          remedy=renamed if kind.suffix else "Save its words as plain text")
    if holds_cues(text):
        raise DnnvssError("holds subtitles, and no plain text", file=path, utterance=utterance,
                          remedy=f"Rename it {path.stem}.srt, or leave the words alone there")
    return text


def check_transcript(path: Path, utterance: str | None = None) -> str:
    """The text of a transcript.

    Raises:
        DnnvssError: as :func:`plain_text` does, or it holds times of words or phones.
    """
    text = plain_text(path, utterance)
    if holds_times(text) or stamped_cues(text) or is_words_csv(path):
        raise DnnvssError("holds times, and no text", file=path, utterance=utterance,
                          remedy=f"Put the words alone there, the times into {path.stem}.TextGrid or {path.stem}.lab")
    return text


def read_transcript(path: Path, utterance: str) -> tuple[str, str]:
    """What is said by a transcript, in one line, and what of it is not said, shortened.

    Raises:
        DnnvssError: as :func:`check_transcript` does.
    """
    text = check_transcript(path, utterance)
    lines = spoken_lines(text, utterance)
    return " ".join(lines), left_out(text, lines)
