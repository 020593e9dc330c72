"""What stands in transcripts and captions and nobody says: who speaks, what else is heard, and marks of files."""

import re
from collections import Counter
from collections.abc import Sequence

_TURN = re.compile(r"\s*>{2,}\s*")
_NUMBERED = r"(?:(?:unknown |guest )?(?:speaker|spk|spkr|participant|interviewer|interviewee)[ _#]?[\dA-Za-z]{0,3})"
_WORD = r"[A-Z][\w.'\u2019-]*"
_HEAD = re.compile(rf"\s*(?:[-\u2013]\s+)?(?:(?P<numbered>(?i:{_NUMBERED}))|(?P<capitals>[A-Z][A-Z .'-]{{1,30}})"
                   rf"|(?P<name>{_WORD}(?:,? (?:{_WORD}|\d{{1,3}})){{0,3}}))\s*:(?:\s+(?=\S)|\s*$)")
"""A line that begins with who speaks, or holds nothing else: ``Speaker 1:``, ``MAN:``, ``Ann Lee:``."""
_AGAIN = 2
"""Lines that begin with the same name, from which it is taken for that of who speaks."""
_SOUNDS = (r"laugh(?:s|ter|ing)?|chuckl(?:es|ing)|sigh(?:s|ing)?|cough(?:s|ing)?|clears throat|sniffs?|gasps?|"
           r"breath(?:s|es|ing)?|unintelligible|indistinct|cross-?talk|music(?: playing)?|applause|beep|silence|"
           r"(?:background )?noise|inaudible|pause")
HEARD = re.compile(rf"\[(?i:{_SOUNDS})\]|\((?i:{_SOUNDS})\)|\*(?i:{_SOUNDS})\*")
"""A sound of a speaker or around one, in brackets or between stars."""
_REMARK = re.compile(rf"<\|[^<>|]{{0,40}}\|>|\[[^\[\]\n]*\]:?|{HEARD.pattern}|^\s*\([^()\n]*\)\s*$", re.MULTILINE)
_SOUND = re.compile(r"\[[^\[\]]*\]:?|\u266a[^\u266a]*\u266a?|\u266b|^\s*[-\u2013]?\s*\([^()]*\)"
                    r"|^\s*#[^#\n]*#\s*$", re.MULTILINE)
"""What captions have beside that: remarks over several lines or before what is said, and songs between notes."""
_DASH = re.compile(r"^\s*[-\u2013]\s+", re.MULTILINE)
"""Before what each of several says."""
_CREDIT = re.compile(r"Transcribed by https?://\S+", re.IGNORECASE)
_HESITATION = re.compile(r"%HESITATION\b", re.IGNORECASE)
_NUMBERED_LINE = re.compile(r"\s*\(?\d{1,4}[.):]\s+(?=[A-Z\"'\u201c\u2018])")
"""The number of a sentence in a list."""
_SAMPLES = re.compile(r"\s*0 \d{4,7} (?=\D)")
"""First and last sample before a sentence, as TIMIT's transcripts have them."""
_FILMED = re.compile(r"\s*Text:[ \t]*(\S[^\n]*)\n(?:.*\n)*?Conf:", re.IGNORECASE)
"""A transcript of the LRS corpora: the text, and below it a table of what a machine found."""


def without_names(lines: Sequence[str]) -> list[str]:
    """Lines without who speaks at their start, and without marks of another's turn (``>>``).

    A name in capitals or with a number always counts, another where several lines begin with it, or half of all with
    one.
    """
    bare = [_TURN.sub(" ", line).strip() for line in lines]
    heads = [_HEAD.match(line) for line in bare]
    often = Counter(head["name"] for head in heads if head)
    usual = len(lines) >= _AGAIN and sum(head is not None for head in heads) >= len(lines) / 2
    return [line[head.end():] if head and (usual or not head["name"] or often[head["name"]] >= _AGAIN) else line
            for line, head in zip(bare, heads, strict=True)]


def without_remarks(text: str) -> str:
    """A text without what is heard beside speech (``[laughter]``, ``(sighs)``) and what Whisper marks (``<|en|>``), a
    hesitation as it sounds."""
    return _HESITATION.sub("uh", _REMARK.sub(" ", _CREDIT.sub("", text)))


def spoken_caption(text: str) -> str:
    """The text of a caption, a line or more, without what is heard beside speech, songs, and dashes before turns."""
    return without_remarks(_DASH.sub("", _SOUND.sub(" ", text)))


def spoken_lines(text: str, utterance: str | None = None) -> list[str]:
    """The lines of a transcript, as far as somebody says them.

    Args:
        text: of the file.
        utterance: the name of the recording, which some tools write before or behind its words.
    """
    if filmed := _FILMED.match(text):
        text = filmed[1]
    if text.strip().count("\n") == 0:
        text = _SAMPLES.sub("", _unnamed(text.strip(), utterance or ""))
    lines = [line for line in without_remarks(text).split("\n") if line.strip()]
    if lines and all(map(_NUMBERED_LINE.match, lines)):
        lines = [_NUMBERED_LINE.sub("", line) for line in lines]
    return [" ".join(line.split()) for line in without_names(lines) if line.strip()]


def left_out(text: str, lines: Sequence[str]) -> str:
    """The words of a text that some lines of it lack, shortened; nothing where they have them all."""
    kept = Counter(word for line in lines for word in line.split())
    lost = []
    for word in text.split():
        if kept[word]:
            kept[word] -= 1
        else:
            lost.append(word)
    return " ".join(lost)[:60]


def _unnamed(line: str, name: str) -> str:
    """A line without the name of its recording, where that cannot be one of its words; of several columns the last, as
    LJSpeech (``ID|written|spoken``) and Piper have them."""
    if len(name) < 4 or not re.search(r"[\d_]", name) or re.fullmatch(r"[1-9]\d*", name):
        return line
    own = re.escape(name)
    if festival := re.fullmatch(rf'\s*\(\s*{own}\s+"(.*)"\s*\)\s*', line, re.IGNORECASE):
        return festival[1]
    if columns := re.fullmatch(rf"{own}(?:\.\w{{2,4}})?\s*\|.*\|([^|]*\w[^|]*)", line, re.IGNORECASE):
        return columns[1].strip()
    line = re.sub(rf"^\s*{own}(?:\.\w{{2,4}})?(?:\s*[|:,;]|\s)\s*(?=\S)", "", line, flags=re.IGNORECASE)
    return re.sub(rf"(?<=\S)\s*\({own}\)\s*$", "", line, flags=re.IGNORECASE)
