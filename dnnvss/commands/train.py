"""Trains a system, evaluates it, and leaves a run folder."""

import math
import shutil
from functools import partial
from pathlib import Path

import joblib
from omegaconf import DictConfig

from dnnvss import files
from dnnvss.commands.plain import run_settings
from dnnvss.corpus import Corpus
from dnnvss.curves import mlpg
from dnnvss.errors import DnnvssError
from dnnvss.evaluation import Report
from dnnvss.evaluation.run import evaluate_run
from dnnvss.face.encoding import FACE, EncodedCorpus, encode_corpus
from dnnvss.render.pictures import keep_ground
from dnnvss.runs.files import RunFiles
from dnnvss.runs.naming import check_begun, delete_run, run_name
from dnnvss.runs.run import Run, make_model, provenance
from dnnvss.runs.settings import RunSettings
from dnnvss.runs.voice import Voice
from dnnvss.speech.durations import DurationModel
from dnnvss.style.generator import Generator, learn_talker, make_style
from dnnvss.systems import NetworkModel
from dnnvss.systems.examples import SPLITS, make_examples, split_examples
from dnnvss.systems.units import UnitPlan, corpus_units, unit_notes
from dnnvss.training.devices import process_number


def train(config: DictConfig) -> float:
    """Train what ``config`` describes and return the correlation over speech on the test split.

    A run that was killed goes on where it stopped; one that is finished is only reported, unless ``overwrite=true``.
    """
    settings = run_settings(config)
    corpus = Corpus.open(config.corpus.out)
    task = settings.task
    model = make_model(settings, task)
    if config.trainer.refine and not isinstance(model, NetworkModel):
        raise DnnvssError(f"trainer.refine does not work with model={config.model.name}",
                          remedy="Use model=feedforward or model=gaussian, or trainer.refine=0")
    folder = Path(config.run or Path(config.runs) / run_name(settings, corpus.fingerprint))
    places = RunFiles(folder)
    helper = process_number() > 0
    if config.overwrite and not helper:  # the first process deletes it for all
        delete_run(folder)
    elif not config.overwrite:
        check_begun(folder, settings, corpus.fingerprint)
        if places.finished:
            print(f"{folder} is finished; overwrite=true trains it anew\n")
            print(places.page.read_text(encoding="utf-8"))
            return float(files.read_json(places.metrics)["headline"])
    folder.mkdir(parents=True, exist_ok=True)
    if not helper:
        settings.write(folder)
        files.write_json(places.provenance, provenance(settings, corpus.fingerprint))

    with joblib.parallel_config(backend="loky", n_jobs=config.jobs):
        encoded = encode(corpus, settings)
    plan = UnitPlan.from_config(config.visemes) if "visemes" in task.table.sources else None
    units = corpus_units(corpus, encoded, config.corpus.split, task.clock, plan) if plan else None
    visemes = units.tiers(plan, encoded.splits["train"]) if plan and units else None
    examples = split_examples(task, corpus, encoded, config.corpus.split, visemes, scratch=folder)
    print(f"training {config.model.name} on {len(examples['train'])} utterances; TensorBoard: {places.tensorboard}")
    model.fit(examples["train"], examples["val"], folder)
    if helper:  # the first process of those that share the fit does the rest
        return math.nan
    if config.trainer.refine and isinstance(model, NetworkModel):
        model.refine(examples["train"], examples["val"], partial(mlpg, windows=task.windows))
    Run.save(folder, task, model)
    if units:
        units.model.save(places.units)
    save_voice(folder, corpus, encoded, config)
    others = {}
    if plan and units:
        source, tiers = units.other_source(plan)
        others = {source: list(make_examples(task, corpus, corpus.split("test", config.corpus.split), encoded, tiers))}
    talker = learn_talker(task, model, examples, encoded.face)
    talker.save(places.talker)
    style = make_style(config.style, encoded.face)
    styles = {} if style.plain else {config.style.name: style}
    notes: list[str] = []
    if plan and units:
        notes, scores = unit_notes(units, plan, examples["test"])
        files.write_json(places.unit_scores, scores)
    report, numbers = evaluate_run(folder, corpus, Generator(task, model, talker), examples, encoded.face, styles,
                                   notes, others)
    headline = report.headline("model")
    if config.sample:
        _render_samples(folder, corpus, report, examples["test"][0].id)
    files.write_json(places.metrics, {"headline": headline, **numbers})
    print(f"\nwrote {folder}: metrics.md, metrics.json, figures/, predictions/, model.pt")
    return headline


def encode(corpus: Corpus, settings: RunSettings) -> EncodedCorpus:
    """The corpus as parameters of a face, which is fitted on the training split alone and kept for later runs."""
    ids = {name: [u.id for u in corpus.split(name, settings.split)] for name in SPLITS}
    encoded = encode_corpus(corpus, ids, settings.face_settings, corpus.root / "face")
    for utterance, reason in encoded.dropped.items():
        print(f"left out: utterance {utterance}: {reason}")
    return encoded


def save_voice(folder: Path, corpus: Corpus, encoded: EncodedCorpus, config: DictConfig) -> None:
    """Write what synthesis needs beside the model: the face and its picture, durations and the talker's phones."""
    train = [u for u in corpus.split("train", config.corpus.split) if u.id not in encoded.dropped]
    places = RunFiles(folder)
    with files.replacing(places.face) as temporary:
        shutil.copyfile(encoded.folder / FACE, temporary)
    keep_ground(corpus, encoded, places.picture)
    DurationModel.fit(train).save(places.durations)
    Voice.of(train, corpus.info).save(places.voice)


def _render_samples(folder: Path, corpus: Corpus, report: Report, first: str) -> None:
    """Write a rendered sentence, and the side-by-side videos that the report of the evaluation shows."""
    from dnnvss.evaluation.videos import worst_middle_best, write_samples

    write_samples(Run.open(folder), corpus, first, worst_middle_best(report))
