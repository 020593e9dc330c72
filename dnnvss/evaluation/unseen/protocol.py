"""A run's system fitted anew without some words, several times, and what it says inside them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from dnnvss import files
from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.bench import leading
from dnnvss.evaluation.cells import number
from dnnvss.evaluation.report import evaluate
from dnnvss.evaluation.runs import open_corpus
from dnnvss.evaluation.unseen.words import HeldOut, held_out, without
from dnnvss.face.base import Face, moving
from dnnvss.formats.tables import aligned, markdown_numbers
from dnnvss.records import read_record
from dnnvss.runs.files import RunFiles
from dnnvss.runs.fitting import altered, encode, gather, refined
from dnnvss.runs.folds import shuffled
from dnnvss.runs.run import make_model
from dnnvss.runs.settings import RunSettings
from dnnvss.style.generator import PLAIN, Generator, learn_talker
from dnnvss.systems import Example, VisualModel
from dnnvss.systems.examples import Task, speech_frames, word_frames
from dnnvss.systems.registry import null_systems

MODEL = "model"
MEASURES = {"inside the words": "frames of words that were held back", "inside the phones":
            "frames of phones that were held back with all their words", "beside them": "all other speech of the same "
            "sentences, whose words training heard"}
"""The columns of the table and what they are."""
_LEAST = 3
"""Sentences that have to be left to train and validate on."""
_REMEDY = "Delete it and run the command again"


@dataclass(frozen=True)
class Leaving:
    """What a split gave.

    Args:
        held: what it held back.
        sentences: how many say some of it, and how many were trained on.
        correlations: system to measure to the mean correlation of the leading coefficients; None where no frame counts.
    """

    held: HeldOut
    sentences: tuple[int, int]
    correlations: Mapping[str, Mapping[str, float | None]]


@dataclass(frozen=True)
class Unheard:
    """What all splits gave.

    Args:
        leavings: of each split.
    """

    leavings: tuple[Leaving, ...]

    def mean(self, system: str, measure: str) -> tuple[float, float]:
        """Mean over splits and half its 95 % interval (Student's t), NaN where it is not known."""
        known = [value for leaving in self.leavings if (value := leaving.correlations[system][measure]) is not None]
        if not known:
            return np.nan, np.nan
        if len(known) < 2:
            return known[0], np.nan
        half = stats.t.ppf(0.975, len(known) - 1) * np.std(known, ddof=1) / np.sqrt(len(known))
        return float(np.mean(known)), float(half)

    def _rows(self) -> list[list[str]]:
        systems = list(self.leavings[0].correlations)
        return [[name, *(_with_interval(*self.mean(name, measure)) for measure in MEASURES)] for name in systems]

    def table(self) -> str:
        """Means with their intervals as text for the screen."""
        return aligned(["system", *MEASURES], self._rows())

    def markdown(self) -> str:
        """Means with their intervals, then every split."""
        own = [[", ".join(each.held.words), ", ".join(each.held.phones) or "none", "{} of {}".format(*each.sentences),
                *(number(_or_nan(each.correlations[MODEL][measure])) for measure in MEASURES)]
               for each in self.leavings]
        told = "\n".join(f"- **{name}**: {what}." for name, what in MEASURES.items())
        return "\n\n".join([
            f"Correlation in plain MLPG, mean over {len(self.leavings)} random splits that hold words and whole phones "
            "back, with the 95 % interval over splits (Student's t). No sentence is of the test split.",
            markdown_numbers(["system", *MEASURES], self._rows()), told,
            markdown_numbers(["held back", "phones", "tested, trained", *MEASURES], own)]) + "\n"

    def save(self, folder: Path) -> Path:
        """Write ``unseen.md`` and ``unseen.json`` into the run's folder ``evaluation`` and return the former."""
        path = RunFiles(folder).unheard
        with files.together(path):
            files.write_text(path.with_suffix(".md"), self.markdown())
            files.write_json(path, asdict(self))
        return path.with_suffix(".md")


def _with_interval(mean: float, half: float) -> str:
    return number(mean) if np.isnan(half) else f"{number(mean)} ± {number(half)}"


def _or_nan(value: float | None) -> float:
    return np.nan if value is None else value


def leave_words_out(folder: Path, splits: int = 4, seed: int = 0, tell: Callable[[str], None] = print) -> Unheard:
    """A run's system, with its settings, fitted without the words of each of some splits.

    Sentences are those of the run's training and validation splits; its test split is not looked at. Each split is kept
    when it is done (``evaluation/unseen/``), so that a command that was killed goes on with the next, and the fit of a
    network goes on from its last epoch.

    Args:
        folder: of a finished run.
        splits: how many.
        seed: of the draw of words.
        tell: what is told as it goes.

    Raises:
        DnnvssError: the run's labels have dynamic visemes, its corpus is not there, or no word can be held back.
    """
    settings = RunSettings.load(folder)
    if "visemes" in settings.task.table.sources:
        raise DnnvssError("its dynamic visemes were learnt from the words that would be held back", file=folder,
                          remedy="Take a run with labels of phones or sound")
    corpus = open_corpus(folder, settings.corpus_folder)
    places = RunFiles(folder)
    material = _Material.of(settings, corpus)
    everything = [*material.examples["train"], *material.examples["val"]]
    found = []
    for k, held in enumerate(held_out([e.alignment for e in everything], splits, seed)):
        path = places.unheard.with_suffix("") / f"{seed}-{k + 1}-of-{splits}.json"
        if not path.is_file():
            tell(f"split {k + 1}: without {', '.join(held.words)}; phones {', '.join(held.phones) or 'none'}")
            left = _left_out(settings, material, held, path.with_suffix(""))
            files.write_json(path, asdict(left))
        left = read_record(Leaving, path, _REMEDY)
        tell(f"split {k + 1}: " + ", ".join(f"{m} {number(_or_nan(left.correlations[MODEL][m]))}" for m in MEASURES))
        found.append(left)
    return Unheard(tuple(found))


@dataclass(frozen=True)
class _Material:
    """Examples of the splits without those of the test, and the face that they move."""

    examples: Mapping[str, list[Example]]
    face: Face

    @classmethod
    def of(cls, settings: RunSettings, corpus: Corpus) -> "_Material":
        encoded, test = encode(settings, corpus), {u.id for u in corpus.split("test", settings.split)}
        examples = altered(settings, corpus, gather(settings, corpus, encoded).examples, ("val",))
        return cls({name: [e for e in own if e.id not in test] for name, own in examples.items()}, encoded.face)


def _left_out(settings: RunSettings, material: _Material, held: HeldOut, scratch: Path) -> Leaving:
    """What systems say of words that they were fitted without."""
    kept, test = without(shuffled([*material.examples["train"], *material.examples["val"]]), held)
    if len(kept) < _LEAST:
        raise DnnvssError(f"{len(kept)} sentences are left without {', '.join(held.words)}",
                          remedy="Record more sentences of different words")
    task, few = settings.task, max(1, len(kept) // 10)
    train, val = kept[few:], kept[:few]
    systems: dict[str, VisualModel] = {MODEL: make_model(settings, task), **null_systems(task.table, task.clock)}
    said: dict[str, dict[str, np.ndarray]] = {}
    for name, model in systems.items():
        if name == MODEL:
            model.take_face(material.face)
            model.shown_on(material.face)
        model.fit(train, val, scratch)
        if name == MODEL:
            refined(settings, model, {"train": train, "val": val}, scratch)
        talker = learn_talker(task, model, {"train": train, "val": val}, material.face)
        generator = Generator(task, model, talker)
        said[name] = {e.id: generator(e, PLAIN) for e in test}
    return Leaving(held, (len(test), len(train)), _correlations(task, material.face, test, said, held))


def _correlations(task: Task, face: Face, test: Sequence[Example], said: Mapping[str, Mapping[str, np.ndarray]],
                  held: HeldOut) -> dict[str, dict[str, float | None]]:
    """Each system's correlation in the frames of each measure."""
    known = {w for e in test for w in e.alignment["words"].labels} - set(held.words)
    found: dict[str, dict[str, float | None]] = {name: {} for name in said}
    for measure, frames in zip(MEASURES, _frames(task, test, held, known), strict=True):
        chosen = [e for e in test if (frames[e.id] & e.measured[1]).sum() > 1]
        references = {e.id: moving(face, e.measured[0][:, 0], frames[e.id] & e.measured[1]) for e in chosen}
        report = evaluate({name: {e.id: own[e.id] for e in chosen} for name, own in said.items()}, references,
                          speech={e.id: frames[e.id] for e in chosen}, first=leading(face),
                          valid={e.id: e.measured[1] for e in chosen}) if chosen else None
        for name in said:
            value = report.headline(name) if report else np.nan
            found[name][measure] = None if np.isnan(value) else round(float(value), 6)
    return found


def _frames(task: Task, test: Sequence[Example], held: HeldOut, known: set[str]) -> list[dict[str, Any]]:
    """The frames (T,) of each sentence that count for each of :data:`MEASURES`."""
    words = {e.id: word_frames(e.alignment, task.clock, known) for e in test}
    phones = {e.id: np.isin(e.alignment["phones"].labels, held.phones)[e.alignment["phones"].frame_index(task.clock)]
              for e in test}
    beside = {e.id: speech_frames(e.alignment, task.clock) & ~words[e.id] for e in test}
    return [words, phones, beside]
