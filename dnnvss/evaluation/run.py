"""The test split: tables, figures and videos of the model beside the null models, plain and in the run's style."""

import math
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.corpus import Corpus
from dnnvss.evaluation import Report, evaluate
from dnnvss.evaluation.bench import Bench, Sentence, leading
from dnnvss.evaluation.calibration import calibration, plot_calibration
from dnnvss.evaluation.cells import number, number_of
from dnnvss.evaluation.comparison import Comparison, compare
from dnnvss.evaluation.measures import MEASURES
from dnnvss.evaluation.optional import attempted
from dnnvss.evaluation.runs import tracked_landmarks
from dnnvss.evaluation.statistics import pooled
from dnnvss.evaluation.verdict import Verdict, verdict
from dnnvss.evaluation.viseme_notes import unit_notes
from dnnvss.face.base import Face, moving
from dnnvss.face.encoding import EncodedCorpus
from dnnvss.face.kinds import face_kind
from dnnvss.formats.tables import aligned, markdown_numbers
from dnnvss.render.plots import plot_trajectories
from dnnvss.runs.files import RunFiles
from dnnvss.runs.fitting import Material, refined
from dnnvss.runs.folds import folded
from dnnvss.runs.headlines import Validation
from dnnvss.runs.run import make_model
from dnnvss.runs.voice import Voice
from dnnvss.style import Style
from dnnvss.style.generator import PLAIN, Generator, learn_talker, make_style
from dnnvss.systems import Example, VisualModel
from dnnvss.systems.examples import Task, speech_frames, word_frames
from dnnvss.systems.registry import driven_by, null_systems, read_system
from dnnvss.systems.viseme_plan import SOURCES

LIVELINESS = ("closure_recall", "closure_precision", "contact_recall", "closure_aperture", "gv_ratio", "silence",
              "landmarks", "lag")
"""Metrics of the second table: what correlation does not see."""

Trajectories = dict[str, np.ndarray]


@dataclass(frozen=True)
class Evaluation:
    """What the test split says about a run.

    Args:
        report: the table of the model and the null models; the row ``model`` is plain MLPG, styles have their own.
        numbers: all of it as plain containers.
        text: the tables, to be printed.
        verdict: what the run is worth, in words.
    """

    report: Report
    numbers: dict[str, Any]
    text: str
    verdict: Verdict | None = None

    @property
    def headline(self) -> float:
        """The correlation over speech."""
        return self.report.headline("model")

    def finish(self, folder: Path) -> Path:
        """Write the numbers, which makes the run in a folder a finished one, and return their path."""
        return files.write_json(RunFiles(folder).metrics, {"headline": self.headline, **self.numbers})


@dataclass(frozen=True)
class Part:
    """A fitted system, and sentences that it has not seen.

    Args:
        generator: the system and its talker.
        examples: ``train`` and ``val``, which it was fitted on, and ``test``.
        others: another source of dynamic visemes (:data:`SOURCES`) to the test examples that have them.
    """

    generator: Generator
    examples: Mapping[str, list[Example]]
    others: Mapping[str, list[Example]] = field(default_factory=dict)


def evaluate_fitted(folder: Path, material: Material, generator: Generator,
                    without: Callable[[int], VisualModel] | None = None) -> Evaluation:
    """The evaluation of a run that was fitted, in plain MLPG and in its own style; writes all but its numbers.

    Where the material is to be left out in parts, a system is fitted for each.

    Args:
        folder: of the run.
        material: that it was fitted on.
        generator: fitted.
        without: gives the system that was fitted without a part of the sentences, by its number; where None, one is
            fitted on this material alone.
    """
    settings, face = material.settings, material.encoded.face
    notes: list[str] = []
    if material.plan and material.units:
        notes, scores = unit_notes(material.units, material.plan, material.examples["test"])
        files.write_json(RunFiles(folder).unit_scores, scores)
    style = make_style(settings.style, face)
    styles = {} if style.plain else {settings.style.name: style}
    lost = material.encoded.left_out
    gaps = {e.id: lost[e.id] for e in material.examples["test"] if e.id in lost}
    cls, _ = read_system(settings.model_name, settings.model)
    judge = partial(verdict, system=settings.model_name, train=material.examples["train"],
                    voice=Voice.load(RunFiles(folder).voice), sources=tuple(settings.model.get("sources", ())),
                    company=tuple(settings.heard_with),
                    listens=driven_by(cls, settings.task.table) == "voice")
    if not material.folds:
        parts = [Part(generator, material.examples, material.other_tests())]
        known = validated(generator, material.examples["val"], face)
        return evaluate_run(folder, material.corpus, parts, material.encoded, styles, notes, judge, gaps, known)
    parts = list(unheard_parts(material, RunFiles(folder).parts, without))
    notes = [f"each said by a system that was trained without it, in {material.folds} parts", *notes]
    found = evaluate_run(folder, material.corpus, parts, material.encoded, styles, notes, judge, gaps)
    shutil.rmtree(RunFiles(folder).parts, ignore_errors=True)
    return found


def validated(generator: Generator, examples: Sequence[Example], face: Face) -> Validation:
    """What a system is worth on validation sentences, by plain MLPG and the metric of the headline.

    Args:
        generator: the fitted system.
        examples: the validation split; no test sentence is among them.
        face: what the trajectories move.
    """
    references, speech, valid = _measured(generator.task, examples, face)
    report = evaluate({"model": _generated(generator, examples, PLAIN)}, references, speech=speech, valid=valid,
                      first=leading(face))
    return Validation(report.headline("model"), tuple(e.id for e in examples))


def _measured(task: Task, examples: Sequence[Example], face: Face) -> tuple[Trajectories, Trajectories, Trajectories]:
    """What examples are measured against: references of what moves, frames of speech, frames that were measured."""
    speech = {e.id: speech_frames(e.alignment, task.clock) for e in examples}
    valid = {e.id: e.measured[1] for e in examples}
    return ({e.id: moving(face, e.measured[0][:, 0], speech[e.id] & valid[e.id]) for e in examples}, speech, valid)


def unheard_parts(material: Material, folder: Path,
                  without: Callable[[int], VisualModel] | None = None) -> Iterator[Part]:
    """A system fitted without each part of the sentences, as the run's own is; killed fits go on from ``folder``."""
    settings, face = material.settings, material.encoded.face
    for k, examples in enumerate(folded(material.examples["test"], material.folds)):
        if without is not None:
            model = without(k)
        else:
            model = make_model(settings, settings.task)
            model.take_face(face)
            model.fit(examples["train"], examples["val"], folder / str(k + 1))
        refined(settings, model, examples, folder / str(k + 1))
        yield Part(Generator(settings.task, model, learn_talker(settings.task, model, examples, face)), examples)


def evaluate_run(folder: Path, corpus: Corpus, parts: Sequence[Part], encoded: EncodedCorpus,
                 styles: Mapping[str, Style], notes: Sequence[str] = (),
                 judge: Callable[[Report], Verdict] | None = None,
                 left_out: Mapping[str, tuple[int, int]] | None = None,
                 validation: Validation | None = None) -> Evaluation:
    """The evaluation of a model beside the null models; predictions, tables and figures go into the run folder.

    Args:
        folder: of the run.
        corpus: what it was trained on.
        parts: the model and what it is tested on; several where sentences were left out in turn, which are pooled.
        encoded: the corpus as its face sees it, which the trajectories move.
        styles: by name, beside plain MLPG.
        notes: what else the reader of the page has to know; the first goes into its title.
        judge: makes a verdict of the table; none is given where it is None.
        left_out: test sentences to the frames of theirs that no score uses, and all of them.
        validation: by which runs are chosen; where None, that is the table itself: sentences were left out in turn, and
            there is no test split.
    """
    task, places, face = parts[0].generator.task, RunFiles(folder), encoded.face
    test = [e for part in parts for e in part.examples["test"]]
    predicted = _pooled([_said(part, styles, folder) for part in parts])
    references = {e.id: e.measured[0][:, 0] for e in test}
    seen, speech, valid = _measured(task, test, face)
    kept = {"predicted": "model", **{f"predicted_{name}": _row(name) for name in styles},
            **{f"predicted_{source}": _row(SOURCES[source]) for source in SOURCES for p in parts if source in p.others}}
    outputs = {"reference": references, "speech": speech, "valid": valid,
               **{name: predicted[row] for name, row in kept.items()}}
    for name, arrays in outputs.items():
        files.write_arrays(places.prediction(name), **arrays)
    report = evaluate(predicted, seen, speech=speech, valid=valid, first=leading(face))
    known = validation or Validation(report.headline("model"), tuple(e.id for e in test))
    chosen = [] if validation is None else [_chosen_by(validation)]
    title = f"{corpus.info.name}, {number_of(len(test), 'test sentence')}, phone times from the recordings"
    title = ", ".join([title, *notes[:1]])
    shown = {name: own for name, own in predicted.items() if name != "training mean"}
    lively = compare(make_bench(task, test, encoded, corpus), shown,
                     measures=tuple(m for m in MEASURES if m.name in LIVELINESS))
    line, unseen = _unseen_words(folder, task, face, parts, predicted, references, valid)
    judged = judge(report) if judge else None
    pages = [title, *([judged.markdown()] if judged else []), *notes[1:],
             *filter(None, [face_kind(face.kind).lacks]), report.markdown(), *chosen,
             *_gaps(left_out or {}), *_lively_part(lively), *unseen, corpus.info.credit]
    files.write_text(places.page, "\n\n".join(pages) + "\n")
    attempted("figures of coefficients",
              lambda: _figures(folder, task, face, test[0], {name: p[test[0].id] for name, p in predicted.items()}))
    numbers = {**report.to_json(), "validation": asdict(known),
               "left_out": {i: list(own) for i, own in (left_out or {}).items()},
               "liveliness": _plain(lively), "calibration": _calibration(folder, parts),
               "verdict": list(judged.lines) if judged else []}
    text = "\n\n".join([title, report.table(), *chosen, aligned(*_lively_rows(lively)), *line])
    return Evaluation(report, numbers, text, judged)


def _said(part: Part, styles: Mapping[str, Style], folder: Path) -> dict[str, Trajectories]:
    """What is said of the test sentences of a part, by row of the table: the model, its styles, the null models."""
    generator, examples = part.generator, part.examples
    task, test = generator.task, examples["test"]
    said = {"model": _generated(generator, test, PLAIN),
            **{_row(name): _generated(generator, test, style) for name, style in styles.items()}}
    said |= {_row(SOURCES[source]): _generated(generator, own, PLAIN) for source, own in part.others.items()}
    for name, system in null_systems(task.table, task.clock).items():
        system.fit(examples["train"], examples["val"], folder)
        said[name] = _generated(Generator(task, system, generator.talker), test, PLAIN)
    return said


def _chosen_by(validation: Validation) -> str:
    """What the page says of the validation split."""
    count = number_of(len(validation.sentences), "sentence")
    return (f"On the validation split, by which runs are chosen ({count}): correlation "
            f"{number(math.nan if validation.headline is None else validation.headline)}.")


def _gaps(left_out: Mapping[str, tuple[int, int]]) -> list[str]:
    """What the page says of frames that were not measured; nothing where all were."""
    told = ", ".join(f"{i} {lost} of {of}" for i, (lost, of) in left_out.items())
    return [f"Frames that could not be measured, which no score uses: {told}."] if told else []


def make_bench(task: Task, test: list[Example], encoded: EncodedCorpus, corpus: Corpus) -> Bench:
    """Return what the harness measures test examples against, as a comparison of finished runs does."""
    sentences, face = [], encoded.face
    for e, (targets, valid) in ((e, e.measured) for e in test):
        speech = speech_frames(e.alignment, task.clock)
        reference = moving(face, targets[:, 0].astype(float), speech & valid)
        landmarks = tracked_landmarks(encoded, corpus, e.id, task.clock, len(reference))
        sentences.append(Sentence(e.id, reference, e.alignment["phones"], speech, valid, landmarks))
    return Bench(tuple(sentences), task.clock, face, leading(face))


def _row(style: str) -> str:
    return f"model, {style}"


def _generated(generator: Generator, examples: Sequence[Example], style: Style) -> Trajectories:
    return {e.id: generator(e, style) for e in examples}


def _pooled(said: Sequence[Mapping[str, Trajectories]]) -> dict[str, Trajectories]:
    """What is said of the sentences of all parts, by row of the table."""
    every: dict[str, Trajectories] = {}
    for rows in said:
        for name, own in rows.items():
            every.setdefault(name, {}).update(own)
    return every


def _lively_part(lively: Comparison) -> list[str]:
    """The part of the page on what correlation does not see."""
    about = "\n".join(f"- **{m.title}**: {m.definition}" for m in lively.measures)
    return ["## Lips, liveliness and stillness", markdown_numbers(*_lively_rows(lively)), *lively.gaps, about]


def _lively_rows(lively: Comparison) -> tuple[list[str], list[list[str]]]:
    rows = [[s, *[number(pooled(lively.pairs[s][m.name])) for m in lively.measures]] for s in lively.pairs]
    return ["system", *[m.title for m in lively.measures]], rows


def _plain(lively: Comparison) -> dict[str, dict[str, float | None]]:
    values = {s: {m.name: pooled(lively.pairs[s][m.name]) for m in lively.measures} for s in lively.pairs}
    return {s: {n: None if np.isnan(v) else round(float(v), 6) for n, v in own.items()} for s, own in values.items()}


def _unseen_words(folder: Path, task: Task, face: Face, parts: Sequence[Part], predicted: Mapping[str, Trajectories],
                  references: Trajectories, valid: Trajectories) -> tuple[list[str], list[str]]:
    """What is printed, and the part of the page, on words that no training sentence holds; empty without any."""
    unseen: dict[str, np.ndarray] = {}
    for part in parts:
        known = {w for e in part.examples["train"] for w in e.alignment["words"].labels}
        unseen |= {e.id: frames for e in part.examples["test"]
                   if (frames := word_frames(e.alignment, task.clock, known)).sum() > 1}
    if not unseen:
        return [], []
    chosen = {name: {i: p[i] for i in unseen} for name, p in predicted.items()}
    seen = {i: moving(face, references[i], frames & valid[i]) for i, frames in unseen.items()}
    inside = evaluate(chosen, seen, speech=unseen, valid={i: valid[i] for i in unseen}, first=leading(face))
    title = f"Inside words that never occur in training ({number_of(len(unseen), 'sentence')})"
    files.write_json(RunFiles(folder).unseen_words, inside.to_json())
    line = f"{title}: correlation " + ", ".join(f"{n} {inside.headline(n):.3f}" for n in chosen)
    return [line], [f"## {title}", "`speech` stands for the frames of these words.", inside.markdown()]


def _calibration(folder: Path, parts: Sequence[Part]) -> dict[str, Any]:
    """Return how well the predicted variances fit the test frames; writes the plot."""
    known = [(*e.measured, part.generator.model.predict(e)) for part in parts for e in part.examples["test"]]
    found = calibration([x[:, 0] for x, _, _ in known], [p.mean[:, 0] for _, _, p in known],
                        [np.broadcast_to(p.variance, p.mean.shape)[:, 0] for _, _, p in known],
                        [v for _, v, _ in known])
    attempted("a figure of calibration",
              lambda: plot_calibration(RunFiles(folder).figure("calibration"), {"model": found}))
    values = {"error": found.error, "spread": found.spread, "log_density": found.density}
    return {name: np.round(v, 6).tolist() for name, v in values.items()}


def _figures(folder: Path, task: Task, face: Face, example: Example, predicted: Trajectories) -> None:
    targets, _ = example.measured
    for d in range(min(5, targets.shape[2])):
        series = {"reference": targets[:, 0, d], **{name: p[:, d] for name, p in predicted.items()}}
        plot_trajectories(RunFiles(folder).figure(f"coefficient_{d + 1}"), series, task.clock.rate,
                          example.alignment["phones"], f"{face.names[d]}, utterance {example.id}")
