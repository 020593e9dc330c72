"""Answers as viewers sent them: each is taken or refused by name, and nothing that it says is believed unread."""

import json
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.viewing.sheet import Sheet, Stimulus, Trial
from dnnvss.records import as_record
from dnnvss.settings import setting, shown

MOST = 1_000_000
"""Bytes of an answer that is read."""
_WORD, _TEXT = 80, 2000
_NAME = re.compile("[0-9a-f]{32}")
_CHOICES = {"preference": ("left", "right", "tie"), "turing": ("real", "synthetic")}
_REMEDY = "Ask the viewer for the file again, as the page wrote it"


@dataclass(frozen=True)
class Seen:
    """A stimulus of a trial, as the page knew it."""

    id: str
    seed: int
    version: str


@dataclass(frozen=True)
class Row:
    """The answer to a trial.

    Args:
        trial: its number.
        stimuli: that were shown, from left to right or first and second.
        choice: what was chosen, of a preference or a Turing test.
        scores: of the stimuli, 0 to 100.
        word: that was chosen or typed.
        plays: how often it was played.
        seconds: until it was answered.
        apart: milliseconds between the first pictures of a pair that moved side by side.
    """

    trial: int = setting(least=0)
    stimuli: tuple[Seen, ...] = setting()
    choice: str | None = None
    scores: tuple[float, ...] = setting((), least=0, most=100)
    word: str | None = None
    plays: int = setting(1, least=0, most=100_000)
    seconds: float = setting(0.0, least=0, most=1e7)
    apart: float | None = setting(None, least=-1e6, most=1e6)


@dataclass(frozen=True)
class Device:
    """What the page was looked at with: the window in CSS pixels, whether it is a phone, and the checks."""

    width: int = setting(0, least=0, most=100_000)
    height: int = setting(0, least=0, most=100_000)
    phone: bool = False
    squares: tuple[int, ...] = setting((), least=0, most=100)
    tones: int | None = setting(None, least=0, most=100)


@dataclass(frozen=True)
class Answer:
    """What the page keeps of a viewer.

    Args:
        format: of this file.
        test: the id of the sheet.
        viewer: a random number of 32 hexadecimal digits, made by the page.
        list: the place that was handed out.
        started, ended: seconds since 1970 by the viewer's clock.
        device: what it was looked at with.
        questions: answers to the questions about the viewer.
        comment: in the viewer's own words.
        rows: an answer to each trial of the list.
    """

    format: int = setting(choices=(1,))
    test: str = setting()
    viewer: str = setting()
    list: int = setting(least=0)
    started: float = setting(least=0, most=1e11)
    ended: float = setting(least=0, most=1e11)
    device: Device = setting()
    rows: tuple[Row, ...] = setting()
    questions: tuple[str, ...] = ()
    comment: str = ""


@dataclass(frozen=True)
class Received:
    """What was sent.

    Args:
        answers: that were taken, by the name of the file.
        refused: why, by the name of the file.
    """

    answers: dict[str, Answer]
    refused: dict[str, str]


def check_answer(sheet: Sheet, value: Any, name: str, by_id: dict[str, Stimulus] | None = None) -> Answer:
    """An answer to a test.

    Args:
        sheet: of the test.
        value: plain containers.
        name: where it came from, for messages.
        by_id: the stimuli of the sheet, where many answers are looked at.

    Raises:
        DnnvssError: it is not as the page writes it, is of another test or list, or lacks an answer; says which.
    """
    answer = as_record(Answer, value, name, _REMEDY)
    stimuli = by_id or {s.id: s for s in sheet.stimuli}
    fault = _fault(sheet, answer) or next(
        (f"trial {row.trial}: {fault}" for row in answer.rows if (fault := _row_fault(sheet, row, stimuli))), None)
    if fault:
        raise DnnvssError(fault, file=name, remedy=_REMEDY)
    return answer


def _fault(sheet: Sheet, answer: Answer) -> str | None:
    """What is wrong with an answer as a whole, None where nothing is."""
    if answer.test != sheet.id:
        return f"is of the test {shown(answer.test)} and not of {sheet.id}"
    if not _NAME.fullmatch(answer.viewer):
        return f"viewer={shown(answer.viewer)} is no number that the page gives out"
    if answer.list >= len(sheet.lists):
        return f"is of list {answer.list}, and there are {len(sheet.lists)}"
    wanted, given = sorted(sheet.lists[answer.list]), sorted(row.trial for row in answer.rows)
    if wanted != given:
        return f"answers {len(given)} trials that are not the {len(wanted)} of list {answer.list}"
    if len(answer.questions) not in (0, len(sheet.design.get("questions", ()))):
        return f"answers {len(answer.questions)} questions, and others were asked"
    if any(len(text) > _TEXT for text in (answer.comment, *answer.questions)):
        return f"holds a text of more than {_TEXT} letters"
    return "ends before it starts" if answer.ended < answer.started else None


def _row_fault(sheet: Sheet, row: Row, stimuli: dict[str, Stimulus]) -> str | None:
    """What is wrong with the answer to a trial, None where nothing is."""
    trial: Trial = sheet.trials[row.trial]
    if tuple(seen.id for seen in row.stimuli) != trial.stimuli:
        return "names other stimuli"
    if any((s.seed, s.version) != (stimuli[s.id].seed, stimuli[s.id].version) for s in row.stimuli):
        return "names stimuli of another seed or version"
    kind = sheet.design["kind"]
    if kind in _CHOICES:
        known = _CHOICES[kind] if kind != "preference" or sheet.design["tie"] else _CHOICES[kind][:2]
        return None if row.choice in known and not row.scores and row.word is None else "holds no choice"
    if kind == "intelligibility":
        if row.word is None or len(row.word) > _WORD or row.choice is not None or row.scores:
            return "holds no word"
        return None if not trial.choices or row.word in trial.choices else f"{shown(row.word)} was no choice"
    scored = len(row.scores) == len(trial.stimuli) and row.choice is None and row.word is None
    return None if scored else f"holds {len(row.scores)} scores"


def read_text(sheet: Sheet, data: bytes, name: str, by_id: dict[str, Stimulus] | None = None) -> Answer:
    """The answer in a file's bytes.

    Raises:
        DnnvssError: as :func:`check_answer` does; or it is no JSON, too long or nested too deeply.
    """
    if len(data) > MOST:
        raise DnnvssError(f"is longer than {MOST} bytes", file=name, remedy=_REMEDY)
    try:
        return check_answer(sheet, json.loads(_text(data), parse_constant=_no_number), name, by_id)
    except RecursionError:
        raise DnnvssError("is nested too deeply", file=name, remedy=_REMEDY) from None
    except ValueError as error:
        raise DnnvssError(f"is no JSON, or cut off ({error})", file=name, remedy=_REMEDY) from error


def _text(data: bytes) -> str:
    """The text in bytes, as whatever editor they went through stored it."""
    return data.decode(files.text_encoding(data)).removeprefix("\ufeff")


def _no_number(name: str) -> Any:
    raise ValueError(f"{name} is no number")


def receive(sheet: Sheet, sent: Iterable[tuple[str, bytes]]) -> Received:
    """Take what is an answer to a test, and say of all else why it is not taken.

    Of answers with one viewer's number the one that ended first is taken.

    Args:
        sheet: of the test.
        sent: names and bytes of files.
    """
    by_id = {s.id: s for s in sheet.stimuli}
    answers, refused = dict[str, Answer](), dict[str, str]()
    for name, data in sent:
        try:
            answers[name] = read_text(sheet, data, name, by_id)
        except DnnvssError as error:
            refused[name] = error.problem
    first: dict[str, str] = {}
    for name in sorted(answers, key=lambda n: (answers[n].ended, n)):
        viewer = answers[name].viewer
        if viewer in first:
            same = answers[name] == answers[first[viewer]]
            refused[name] = f"is a copy of {first[viewer]}" if same else f"is by the viewer of {first[viewer]}, later"
        else:
            first[viewer] = name
    return Received({name: a for name, a in answers.items() if name not in refused}, refused)


def answer_files(folder: Path) -> Iterator[tuple[str, bytes]]:
    """Names and bytes of the answers in a folder, of a file that is too long a byte more than is taken.

    They are the ``.json`` files; mail programs make ``.json.txt`` of it, or ``.txt``.

    Raises:
        DnnvssError: there is no such folder.
    """
    if not folder.is_dir():
        raise DnnvssError("no such folder", file=folder, remedy="Name the folder in which the answers lie")
    found = sorted(p for p in folder.iterdir() if not p.name.startswith(".")
                   and (".json" in p.name.lower() or p.suffix.lower() == ".txt"))
    return ((path.name, _bytes(path)) for path in found)


def _bytes(path: Path) -> bytes:
    """What a file holds; nothing where it cannot be read or is a link to another place."""
    if path.is_symlink() or not path.is_file():
        return b""
    try:
        with path.open("rb") as file:
            return file.read(MOST + 1)
    except OSError:
        return b""
