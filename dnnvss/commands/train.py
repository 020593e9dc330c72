"""``dnnvss train corpus=NAME``: trains a system and evaluates it; settings in ``conf/train.yaml``."""

import math
from collections.abc import Sequence
from pathlib import Path

from omegaconf import DictConfig

from dnnvss import files
from dnnvss.commands.composed import run_command
from dnnvss.commands.sweep import sweepable
from dnnvss.commands.train_settings import COMMAND, run_settings
from dnnvss.commands.usage import guarded
from dnnvss.corpus import Corpus
from dnnvss.evaluation.choice import Choice, settled
from dnnvss.evaluation.optional import attempted
from dnnvss.evaluation.run import evaluate_fitted
from dnnvss.evaluation.videos import write_samples
from dnnvss.processes import end_with_parent, name_parent
from dnnvss.records import read_value
from dnnvss.runs.files import RunFiles
from dnnvss.runs.fitting import begin, encode, gather, keep, new_model
from dnnvss.runs.naming import run_folder
from dnnvss.runs.run import Run
from dnnvss.runs.settings import RunSettings
from dnnvss.staging import reading
from dnnvss.systems import VisualModel
from dnnvss.training.devices import process_number


def main(arguments: Sequence[str]) -> int:
    """Train what the arguments describe."""
    return run_command(COMMAND, arguments, job, always_hydra=True)


@guarded
@sweepable
def job(config: DictConfig) -> float:
    """Train what composed settings describe: a job of hydra's, alone or in a sweep."""
    return train(config)


def train(config: DictConfig) -> float:
    """Train what ``config`` describes and return the correlation over speech on the test split.

    A run that was killed goes on where it stopped; one that is finished is only reported, unless ``overwrite=true``.
    """
    settings = run_settings(config)
    root = settings.corpus_folder
    if process_number() > 0:
        end_with_parent()
        return _trained(settings, helper=True)
    name_parent()
    with reading(root):
        return _trained(settings, helper=False)


def _trained(settings: RunSettings, helper: bool) -> float:
    """Train what settings describe, alone in the run's folder unless this process helps another."""
    corpus = Corpus.open(settings.corpus_folder)
    settings, choice = settled(settings, corpus)
    if choice is not None:
        print(choice.text)
    model = new_model(settings)
    folder = run_folder(settings, corpus.fingerprint)
    if helper:
        return _fitted(settings, corpus, model, folder, choice)
    files.make_folder(folder.parent)
    with files.locked(folder, f"waiting for the command that trains {folder}"):
        return _fitted(settings, corpus, model, folder, choice)


def _fitted(settings: RunSettings, corpus: Corpus, model: VisualModel, folder: Path, choice: Choice | None) -> float:
    """Fit, evaluate and keep a system; ``choice`` says why it was chosen, where it was not named."""
    places, helper = RunFiles(folder), process_number() > 0
    if begin(folder, settings, corpus, first=not helper):
        return _told(places)
    if choice is not None:
        choice.save(places.choice)
    encoded = encode(settings, corpus)
    for utterance, reason in encoded.dropped.items():
        print(f"left out: utterance {utterance}: {reason}")
    for line in encoded.told:
        print(line)
    material = gather(settings, corpus, encoded, scratch=folder)
    print(f"training {settings.model_name} on {len(material.examples['train'])} utterances; "
          f"TensorBoard: {places.tensorboard}")
    model.take_face(encoded.face)
    model.shown_on(encoded.face)
    model.fit(material.examples["train"], material.examples["val"], folder)
    if helper:  # the first process of those that share the fit does the rest
        return math.nan
    generator = keep(material, model, folder)
    for setting, reason in generator.talker.unknown.items():
        print(f"{reason}: style.{setting} will have no effect")
    found = evaluate_fitted(folder, material, generator)
    print(f"\n{found.text}")
    judged = found.verdict
    if judged is not None:
        judged.write(places.verdict, f"Verdict: {folder.name}", choice.text if choice else "")
        print(f"\n{judged.text}")
    if settings.sample:
        ids = [e.id for e in material.examples["val" if material.folds else "test"]]
        attempted("samples", lambda: write_samples(Run.open(folder), corpus, ids, found.report))
    found.finish(folder)
    written = (places.verdict, places.page, places.metrics, places.predictions, places.model)
    kept = ", ".join(path.name for path in written)
    print(f"\nwrote {folder}: {kept}")
    return found.headline


def _told(places: RunFiles) -> float:
    """Print what a finished run was worth and return its headline."""
    print(f"{places.folder} is finished; overwrite=true trains it anew\n")
    remedy = "Train the run anew: overwrite=true"
    print(files.read_text(places.page, remedy))
    return read_value(places.metrics, "headline", float, remedy)
