"""What is said in a long recording, word by word, with what each word is written as and about when it is said."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate

from dnnvss.formats import Cue
from dnnvss.text.sentence import spoken_words

_SENTENCE = re.compile(r"(?<=[.!?\u2026])[\"')\u201d\u2019]*\s+")
_MANY = 40
"""Pieces between spaces from which text without a full stop is read in parts."""
_PAUSE = 0.5
"""Seconds between two words of a recogniser from which they are not read together."""


@dataclass(frozen=True)
class Line:
    """A sentence, or a cue: read as one.

    Args:
        text: as written.
        words: as spoken, each with whether a phrase ends behind it.
        start, end: seconds, where they are given.
        whole: a sentence or a line ends behind it.
    """

    text: str
    words: tuple[tuple[str, bool], ...]
    start: float | None
    end: float | None
    whole: bool


class Script:
    """The words of a long recording.

    Args:
        cues: what is said, in order.
        variant: of English.
    """

    def __init__(self, cues: Sequence[Cue], variant: str) -> None:
        self.variant = variant
        made = (Line(cue.text, spoken_words(cue.text, variant), cue.start, cue.end, whole)
                for cue, whole in _lines(cues))
        self.lines = [line for line in made if line.words]
        self._firsts = [0, *accumulate(len(line.words) for line in self.lines)]
        self.words = [word for line in self.lines for word, _ in line.words]

    @property
    def ends(self) -> list[bool]:
        """Whether a sentence, a phrase or a line ends after each word."""
        return [phrase or (line.whole and k == len(line.words) - 1)
                for line in self.lines for k, (_, phrase) in enumerate(line.words)]

    @property
    def given(self) -> list[tuple[float, float] | None]:
        """About when each word begins and by how much that may be wrong, in seconds; None where it is not told."""
        found: list[tuple[float, float] | None] = []
        for line in self.lines:
            if line.start is None or line.end is None:
                found += [None] * len(line.words)
            else:
                step = (line.end - line.start) / len(line.words)
                found += [(line.start + k * step, line.end - line.start) for k in range(len(line.words))]
        return found

    def text(self, first: int, last: int) -> str:
        """What the words ``first`` to ``last - 1`` are written as."""
        parts = []
        for line, start in zip(self.lines, self._firsts, strict=False):
            a, b = max(first - start, 0), min(last - start, len(line.words))
            if a < b:
                parts.append(line.text if b - a == len(line.words) else self._part(line, a, b))
        return " ".join(parts)

    def _part(self, line: Line, a: int, b: int) -> str:
        """Part of a line: what is written between spaces, where that is just its words; else the words."""
        pieces, words = line.text.split(), [word for word, _ in line.words]
        counts = [len(spoken_words(" ".join(pieces[:k]), self.variant)) for k in range(len(pieces) + 1)]
        if a in counts and b in counts:
            start = max(k for k, count in enumerate(counts) if count == a) if a else 0
            text = " ".join(pieces[start : counts.index(b)])
            if [word for word, _ in spoken_words(text, self.variant)] == words[a:b]:
                return text
        return " ".join(words[a:b])


def _lines(cues: Sequence[Cue]) -> Iterator[tuple[Cue, bool]]:
    """Yield the text in sentences and cues, each with whether it is known to end there."""
    for cue in _together(cues):
        if cue.start is not None:
            yield cue, True
            continue
        for sentence in _SENTENCE.split(cue.text):
            pieces = sentence.split()
            for at in range(0, len(pieces), _MANY):
                yield Cue(None, None, " ".join(pieces[at : at + _MANY])), at + _MANY >= len(pieces)


def _together(cues: Sequence[Cue]) -> Iterator[Cue]:
    """Yield cues, those of a single word each made one up to the end of a sentence or a pause."""
    held: list[Cue] = []
    for cue in cues:
        alone = cue.start is not None and len(cue.text.split()) == 1
        if held and (not alone or len(held) >= _MANY or (cue.start or 0) - (held[-1].end or 0) > _PAUSE
                     or held[-1].text[-1:] in ".!?\u2026"):
            yield _one(held)
            held = []
        if alone:
            held.append(cue)
        else:
            yield cue
    if held:
        yield _one(held)


def _one(cues: Sequence[Cue]) -> Cue:
    return Cue(cues[0].start, cues[-1].end, " ".join(cue.text for cue in cues))
