"""``dnnvss train corpus=NAME``: trains a system and evaluates it; settings in ``conf/train.yaml``."""

import math
from collections.abc import Sequence
from pathlib import Path

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig

from dnnvss import files
from dnnvss.commands.composed import run_command
from dnnvss.commands.several import several_corpora, with_lists
from dnnvss.commands.sweep import sweepable
from dnnvss.commands.train_settings import COMMAND, run_settings
from dnnvss.commands.train_steps import finished, gathered, told
from dnnvss.commands.train_together import train_together
from dnnvss.commands.usage import guarded
from dnnvss.corpus import Corpus
from dnnvss.evaluation.choice import Choice, settled
from dnnvss.processes import end_with_parent, name_parent
from dnnvss.runs.files import RunFiles
from dnnvss.runs.fitting import begin, new_model
from dnnvss.runs.naming import run_folder
from dnnvss.runs.settings import RunSettings
from dnnvss.staging import reading
from dnnvss.systems import VisualModel
from dnnvss.training.devices import process_number


def main(arguments: Sequence[str]) -> int:
    """Train what the arguments describe."""
    return run_command(COMMAND, with_lists(arguments), job, always_hydra=True)


@guarded
@sweepable
def job(config: DictConfig) -> float:
    """Train what composed settings describe: a job of hydra's, alone or in a sweep."""
    if (corpora := several_corpora(config)) is not None:
        return train_together(corpora, HydraConfig.get().overrides.task)
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
        return told(places)
    if choice is not None:
        choice.save(places.choice)
    material = gathered(settings, corpus, folder)
    print(f"training {settings.model_name} on {len(material.examples['train'])} utterances; "
          f"TensorBoard: {places.tensorboard}")
    model.take_face(material.encoded.face)
    model.shown_on(material.encoded.face)
    model.fit(material.examples["train"], material.examples["val"], folder)
    if helper:  # the first process of those that share the fit does the rest
        return math.nan
    return finished(folder, material, model, choice)
