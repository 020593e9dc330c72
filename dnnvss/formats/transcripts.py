"""Whether a text file is the words of a recording, and not something that was given its name."""

import json
from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats.htk import holds_times
from dnnvss.formats.stamped_text import stamped_cues
from dnnvss.formats.subtitles import holds_cues
from dnnvss.formats.timed_text import is_words_csv
from dnnvss.formats.unsaid import left_out, spoken_lines

_WORDS = "Write the words of the recording there"
_MARKS = {"{\\rtf": "RTF", "<!doctype": "HTML", "<html": "HTML", "<?xml": "XML", "%pdf": "PDF", "webvtt": "WebVTT"}
"""How files of other kinds begin, in lower case, and what they are called."""


def check_transcript(path: Path, utterance: str | None = None) -> str:
    """The text of a transcript.

    Raises:
        DnnvssError: it cannot be read, or is no plain text: times of words or phones, subtitles, JSON, RTF, HTML.
    """
    text = files.read_text(path, _WORDS)
    begins = text.lstrip("\ufeff \t\n")[:20].lower()
    if kind := next((kind for mark, kind in _MARKS.items() if begins.startswith(mark)), ""):
        raise DnnvssError(f"is {kind}, and no plain text", file=path, utterance=utterance,
                          remedy="Save it as plain text" if kind != "WebVTT" else f"Rename it {path.stem}.vtt")
    if holds_cues(text):
        raise DnnvssError("holds subtitles, and no plain text", file=path, utterance=utterance,
                          remedy=f"Rename it {path.stem}.srt, or leave the words alone there")
    if _is_json(text):
        raise DnnvssError("is JSON, and no plain text", file=path, utterance=utterance,
                          remedy=f"Rename it {path.stem}.json, or write the words alone there")
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


def _is_json(text: str) -> bool:
    if text.lstrip()[:1] not in ("{", "["):
        return False
    try:
        return isinstance(json.loads(text), dict | list)
    except (ValueError, RecursionError):
        return False
