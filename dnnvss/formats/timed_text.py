"""What is said in a recording and about when, from any file that tells it."""

from dataclasses import replace
from pathlib import Path

from dnnvss.errors import DnnvssError
from dnnvss.formats.alignments import read_alignment
from dnnvss.formats.cues import Cue
from dnnvss.formats.labels import word_of
from dnnvss.formats.pace import check_cues
from dnnvss.formats.recognised import read_recognised, read_whisper_table
from dnnvss.formats.stamped_text import stamped_cues
from dnnvss.formats.subtitles import read_subtitles
from dnnvss.formats.transcripts import plain_text
from dnnvss.formats.unsaid import spoken_lines, without_names, without_remarks
from dnnvss.formats.words import head_of, read_words_csv
from dnnvss.timing import Tier

SUBTITLES = (".srt", ".vtt")
"""Files of subtitles."""
TIMED = (*SUBTITLES, ".json")
"""Files that tell what is said and when, and nothing else."""


def read_timed_text(path: str | Path) -> tuple[Cue, ...]:
    """What is said and about when: subtitles, times of words (CSV, TSV, TextGrid, CTM, a recogniser's JSON), or text.

    A plain text gives a cue a line, without times where its lines have none.

    Raises:
        DnnvssError: another suffix, a damaged file, or no word in it.
    """
    path = Path(path)
    match path.suffix.lower():
        case ".srt" | ".vtt":
            return read_subtitles(path)
        case ".json":
            return read_recognised(path)
        case ".tsv" if _is_whispers(path):
            return read_whisper_table(path)
        case ".csv" | ".tsv":
            return check_cues(_words(read_words_csv(path)["words"], path), path)
        case ".textgrid" | ".ctm":
            grid = read_alignment(path, path.stem)
            if "words" not in grid:
                raise DnnvssError("holds no tier of words", file=path, remedy="Name the tier of words words")
            return _words(grid["words"], path)
        case ".txt" | ".lab":
            text = plain_text(path)
            return _stamped(text) or tuple(Cue(None, None, line) for line in spoken_lines(text, path.stem))
    raise DnnvssError(f"text of the kind {path.suffix!r} is not understood", file=path,
                      remedy="Use .srt, .vtt, .txt, .json, .csv or .tsv (start,end,word), .ctm or .TextGrid")


def _is_whispers(path: Path) -> bool:
    """Whether a table is as Whisper writes it, by its first line."""
    return head_of(path).partition("\n")[0].strip().lower().split("\t") == ["start", "end", "text"]


def _words(tier: Tier, path: Path) -> tuple[Cue, ...]:
    found = tuple(Cue(s.start, s.end, s.label) for s in tier if word_of(s.label))
    if not found:
        raise DnnvssError("holds no word", file=path, remedy="Give the file that holds the words")
    return found


def _stamped(text: str) -> tuple[Cue, ...]:
    """The cues of a text with times in its lines, as far as somebody says them."""
    cues = stamped_cues(text)
    said = without_names([" ".join(without_remarks(cue.text).split()) for cue in cues])
    return tuple(replace(cue, text=line) for cue, line in zip(cues, said, strict=True) if line)
