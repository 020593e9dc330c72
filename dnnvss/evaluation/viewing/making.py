"""A test made of runs: its stimuli, who sees what, and the sheet that says what is what."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import __version__, files
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.viewing.design import Condition, Design, conditions_of, treatments
from dnnvss.evaluation.viewing.lists import cells_of, check_places, list_count, ordered
from dnnvss.evaluation.viewing.material import Item, alternatives, choose_items
from dnnvss.evaluation.viewing.sheet import ANSWERS, PAGE, Sheet, Shown, Stimulus, Trial
from dnnvss.evaluation.viewing.stimuli import Studio, make_clip, stimulus_id, write_clip
from dnnvss.processes import parallel

Told = Callable[[int, int], None]
"""Is told how many stimuli are finished, and of how many."""
CHECK_WORD = "check"
"""What is to be typed where a viewer's attention is checked."""


@dataclass(frozen=True)
class Job:
    """A process's share of the stimuli."""

    design: Design
    folders: tuple[Path, ...]
    conditions: tuple[Condition, ...]
    items: tuple[tuple[int, Item], ...]
    out: Path


def make_test(design: Design, folders: Sequence[Path], names: Sequence[str], out: Path, jobs: int = 1,
              told: Told = lambda done, total: None) -> Sheet:
    """Render the stimuli of a test and write ``page/`` (what viewers get) and ``key.json`` (what they must not get).

    Stimuli that are there already stay: the same command again goes on where it stopped.

    Args:
        design: of the test.
        folders: of the runs.
        names: of the runs, for tables.
        out: the folder of the test.
        jobs: processes.
        told: is told of every stimulus that is finished; of those of several processes at the end.

    Raises:
        DnnvssError: runs that do not fit together, too few sentences, a condition that cannot be shown or shows what
            another does, or a folder with answers to another test.
    """
    conditions = conditions_of(design, names)
    studio = Studio.open(design, folders)
    items, practice = choose_items({i: studio.corpus.utterances[i] for i in studio.unlearnt}, design)
    shown = [studio.shown(c) for c in conditions]
    _check_different(studio, conditions, shown, items[0])
    numbered = list(enumerate([*items, *(p for p in practice if p not in items)]))
    _keep_answered(out, lambda old: (old.design, old.version, old.conditions, old.sentences) == (
        _plain(asdict(design)), __version__, tuple(shown), tuple(item.id for _, item in numbered)))
    jobs = max(1, min(jobs, len(numbered)))
    shares = [Job(design, tuple(folders), conditions, tuple(numbered[k::jobs]), out) for k in range(jobs)]
    stimuli = [s for made in _rendered(shares, studio, told) for s in made]
    stimuli.sort(key=lambda s: (s.sentence, s.condition))
    said = [(item.id, item.text) for _, item in numbered]
    tried = [[i for _, i in numbered].index(p) for p in practice]
    sheet = lay_out(design, conditions, shown, said, len(items), tried, stimuli)
    _keep_answered(out, lambda old: old.id == sheet.id)
    write_sheet(sheet, out)
    return sheet


def _check_different(studio: Studio, conditions: Sequence[Condition], shown: Sequence[Shown], item: Item) -> None:
    """Refuse conditions of which viewers would see the same video."""
    names: dict[str, str] = {}
    for condition, as_shown in zip(conditions, shown, strict=True):
        other = names.setdefault(stimulus_id(studio, condition, as_shown, item), condition.name)
        if other != condition.name:
            raise DnnvssError(f"the conditions {other} and {condition.name} show the same",
                              remedy="Leave one of them out")


def _keep_answered(out: Path, same: Callable[[Sheet], bool]) -> None:
    """Refuse to replace the key of a test that has been answered: without it nobody knows what the answers mean.

    A key that cannot be read is replaced: the command that made the test makes it again.

    Raises:
        DnnvssError: the folder holds answers to a test that is not the ``same``.
    """
    if not any((out / ANSWERS).glob("*.json")):
        return
    try:
        old = Sheet.open(out)
    except DnnvssError:
        return
    if not same(old):
        raise DnnvssError("holds answers to another test, which would be lost with its key", file=out,
                          remedy="Write this test to another folder: --out FOLDER")


def write_sheet(sheet: Sheet, out: Path) -> None:
    """Write the sheet of a test, and the part of it that the page may know."""
    sheet.save(out)
    files.write_text(out / PAGE / "test.js", f"const TEST = {script_json(sheet.public())};\n")


def script_json(value: Any) -> str:
    """JSON that may stand in a script, whatever its texts hold."""
    text = files.json_text(value, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def _rendered(shares: Sequence[Job], studio: Studio, told: Told) -> list[list[Stimulus]]:
    if len(shares) == 1:
        return [_render(shares[0], studio, told)]
    from joblib import Parallel, delayed

    with parallel(len(shares)):
        made: list[list[Stimulus]] = Parallel()(delayed(_render)(job) for job in shares)
    count = sum(map(len, made))
    told(count, count)
    return made


def _render(job: Job, studio: Studio | None = None, told: Told = lambda done, total: None) -> list[Stimulus]:
    """Write the stimuli of a share that are not there yet."""
    studio = studio or Studio.open(job.design, job.folders)
    found = []
    for number, item in job.items:
        for k, condition in enumerate(job.conditions):
            name = stimulus_id(studio, condition, studio.shown(condition), item)
            path = job.out / PAGE / "stimuli" / f"{name}.mp4"
            clip = make_clip(studio, condition, item)
            if not path.is_file():
                write_clip(clip, path, job.design.quality)
            found.append(Stimulus(name, k, number, round(clip.seconds, 6), float(clip.clock.rate), job.design.seed,
                                  __version__))
            told(len(found), len(job.items) * len(job.conditions))
    return found


def lay_out(design: Design, conditions: Sequence[Condition], shown: Sequence[Shown],
            said: Sequence[tuple[str, str]], count: int, practice: Sequence[int], stimuli: Sequence[Stimulus]) -> Sheet:
    """The sheet of a test: trials, lists, and what belongs to each number.

    Args:
        design, conditions: of the test.
        shown: what the sheet says of each condition.
        said: id and words of all items.
        count: how many of them count; the others are for the trial run alone.
        practice: numbers of the items of the trial run.
        stimuli: a video of each condition of each item.
    """
    trials = Trials(design, conditions, [words for _, words in said], stimuli)
    lists = [trials.row(number, count) for number in range(trials.count(count))]
    tried = [trials.at(s, k % len(trials.treatments)) for k, s in enumerate(practice)]
    return Sheet.made(
        design=_plain(asdict(design)), version=__version__, conditions=tuple(shown),
        sentences=tuple(i for i, _ in said), words=tuple(words for _, words in said), stimuli=tuple(stimuli),
        trials=tuple(trials.made), lists=tuple(tuple(row) for row in lists), practice=tuple(tried))


class Trials:
    """The trials of a test, each made when a list first asks for it.

    Args:
        design, conditions: of the test.
        words: what is said in each item.
        stimuli: a video of each condition of each item.
    """

    def __init__(self, design: Design, conditions: Sequence[Condition], words: Sequence[str],
                 stimuli: Sequence[Stimulus]) -> None:
        self.design, self.words, self.made = design, words, list[Trial]()
        self.treatments = treatments(design, conditions)
        self.ways = 2 if design.pairs else 1
        self._ids = {(s.sentence, s.condition): s.id for s in stimuli}
        self._numbers: dict[Trial, int] = {}

    def _shape(self, items: int) -> tuple[int, int, int, bool, int]:
        every = self.design.each == "every"
        return items, self.design.per_viewer, len(self.treatments), every, self.ways

    def count(self, items: int) -> int:
        """How many lists there are, of so many items."""
        return list_count(*self._shape(items))

    def row(self, number: int, items: int) -> list[int]:
        """The trials of a list, attention checks among them."""
        cells = ordered(cells_of(number, *self._shape(items)), self.design.seed, number)
        row = [self.at(*cell) for cell in cells]
        places = check_places(len(row), self.design.checks, self.design.seed, number)
        for k, place in reversed(list(enumerate(places))):
            s, t = cells[int(np.random.default_rng([self.design.seed, number, k, 5]).integers(len(cells)))]
            row.insert(place, self.at(s, t, _expected(self.design, (number + k) % 2)))
        return row

    def at(self, sentence: int, treatment: int, expect: str | None = None) -> int:
        """The number of a trial."""
        ids = tuple(self._ids[sentence, condition] for condition in self.treatments[treatment])
        choices: tuple[str, ...] = ()
        if self.design.kind == "intelligibility" and self.design.alternatives:
            choices = alternatives(self.words, sentence, self.design.alternatives, self.design.seed)
            expect = choices[0] if expect else None
        trial = Trial(ids, choices, expect)
        if trial not in self._numbers:
            self._numbers[trial] = len(self.made)
            self.made.append(trial)
        return self._numbers[trial]


def _expected(design: Design, side: int) -> str:
    """What an attention check asks for."""
    if design.scored:
        return ("least", "most")[side]
    if design.kind == "intelligibility":
        return CHECK_WORD
    return {"preference": ("left", "right"), "turing": ("real", "synthetic")}[design.kind][side]


def _plain(value: Any) -> Any:
    """Plain containers of what a settings dataclass holds."""
    if isinstance(value, dict):
        return {key: _plain(part) for key, part in value.items()}
    return [_plain(part) for part in value] if isinstance(value, list | tuple) else value
