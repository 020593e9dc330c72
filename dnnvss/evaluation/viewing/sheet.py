"""The sheet of a test, ``key.json``: what every stimulus is. Whoever has it knows what viewers must not."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.viewing.design import Design
from dnnvss.records import as_record, read_record
from dnnvss.settings import setting

KEY, PAGE, ANSWERS = "key.json", "page", "answers"
CHANGED = "changed"
"""The style of a condition with settings of its own, which no comparison of runs measures."""
_REMEDY = "Make the test again: dnnvss viewing make DESIGN RUN ... --out FOLDER"


@dataclass(frozen=True)
class Shown:
    """A condition of the test.

    Args:
        name: in tables.
        shows: a run or an anchor.
        style: of the movement, as a comparison of runs names it; :data:`CHANGED` where no comparison shows it so.
        run: folder of the run; empty for the recording.
        digest: of what the run learnt.
    """

    name: str
    shows: str
    style: str = "plain"
    run: str = ""
    digest: str = ""


@dataclass(frozen=True)
class Stimulus:
    """A video.

    Args:
        id: also the stem of its file; says nothing.
        condition, sentence: their numbers.
        seconds: it lasts.
        rate: frames a second.
        seed, version: it was made with.
    """

    id: str
    condition: int = setting(least=0)
    sentence: int = setting(least=0)
    seconds: float = setting(least=0)
    rate: float = setting(above=0)
    seed: int = setting(least=0)
    version: str = setting()


@dataclass(frozen=True)
class Trial:
    """What is asked at a time.

    Args:
        stimuli: ids, from left to right or one after the other.
        choices: words to choose from.
        expect: what is right where it is an attention check: a choice, a word, ``least`` or ``most`` on every slider.
    """

    stimuli: tuple[str, ...]
    choices: tuple[str, ...] = ()
    expect: str | None = None


@dataclass(frozen=True)
class Sheet:
    """A test.

    Args:
        id: of everything below.
        design: its settings by name.
        version: of the program.
        conditions: that are compared.
        sentences: ids; of words, ``utterance:position``.
        words: what is said: the text of a sentence, or the word.
        stimuli: the videos.
        trials: that there are, checks among them.
        lists: numbers of trials, a row for each place that is handed out.
        practice: numbers of trials that nobody counts.
    """

    id: str
    design: Mapping[str, Any]
    version: str
    conditions: tuple[Shown, ...]
    sentences: tuple[str, ...]
    words: tuple[str, ...]
    stimuli: tuple[Stimulus, ...]
    trials: tuple[Trial, ...]
    lists: tuple[tuple[int, ...], ...]
    practice: tuple[int, ...] = ()

    @classmethod
    def made(cls, **parts: Any) -> "Sheet":
        """The sheet of its parts, with the id that follows from them."""
        whole = asdict(cls(id="", **parts))
        text = files.json_text(whole, sort_keys=True)
        return cls(id=hashlib.sha256(text.encode()).hexdigest()[:16], **parts)

    @classmethod
    def open(cls, folder: Path) -> "Sheet":
        """The sheet in the folder of a test.

        Raises:
            DnnvssError: there is none, or it is damaged or of no test.
        """
        sheet = read_record(cls, folder / KEY, _REMEDY)
        design = asdict(as_record(Design, sheet.design, folder / KEY, _REMEDY, "design"))
        if fault := sheet.fault():
            raise DnnvssError(fault, file=folder / KEY, remedy=_REMEDY)
        return replace(sheet, design={**json.loads(files.json_text(design)), **sheet.design})

    def fault(self) -> str | None:
        """What names something in it that is not there, None where nothing does."""
        known, count = {s.id for s in self.stimuli}, len(self.trials)
        shown = all(s.condition < len(self.conditions) and s.sentence < len(self.sentences) for s in self.stimuli)
        count_shown = 2 if self.design.get("kind") in ("preference", "dscqs") else 1
        asked = all(len(t.stimuli) == count_shown and known.issuperset(t.stimuli) for t in self.trials)
        if len(known) < len(self.stimuli) or not shown or not asked or len(self.words) != len(self.sentences):
            return "names conditions, sentences or stimuli that are not in it"
        handed = [number for row in (*self.lists, self.practice) for number in row]
        if not self.lists or not all(self.lists) or any(not 0 <= number < count for number in handed):
            return f"names trials that are not among its {count}, or hands out none"
        return None

    def save(self, folder: Path) -> Path:
        """Write ``key.json`` and return its path."""
        return files.write_json(folder / KEY, asdict(self))

    def public(self) -> dict[str, Any]:
        """What the page may know: neither conditions nor sentences, which the order of the stimuli would tell."""
        told = ("kind", "title", "instructions", "consent", "question", "labels", "tie", "rest", "replays", "phones",
                "screen", "headphones", "questions")
        stimuli = [{"id": s.id, "seconds": s.seconds, "rate": s.rate, "seed": s.seed, "version": s.version}
                   for s in sorted(self.stimuli, key=lambda s: s.id)]
        return {"id": self.id, **{name: self.design[name] for name in told}, "stimuli": stimuli,
                "trials": [asdict(t) for t in self.trials], "lists": [list(row) for row in self.lists],
                "practice": list(self.practice)}
