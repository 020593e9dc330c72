"""``dnnvss train corpus=[a,b]``: one training of several talkers, which leaves a run of each."""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from dnnvss import files
from dnnvss.commands.several import SeveralCorpora, each_alone
from dnnvss.commands.train_settings import run_settings
from dnnvss.commands.train_steps import finished, gathered, told
from dnnvss.corpus import Corpus
from dnnvss.evaluation.choice import largest
from dnnvss.processes import end_with_parent, name_parent
from dnnvss.runs.files import RunFiles
from dnnvss.runs.fitting import begin
from dnnvss.runs.naming import run_folder
from dnnvss.runs.settings import RunSettings
from dnnvss.runs.together import TogetherFit, begin_together, joined
from dnnvss.staging import reading
from dnnvss.training.devices import process_number


@dataclass(frozen=True)
class Together:
    """A training of several talkers.

    Args:
        settings: of each talker's run.
        corpora: prepared.
    """

    settings: Mapping[str, RunSettings]
    corpora: Mapping[str, Corpus]

    @property
    def folder(self) -> Path:
        """Where the runs lie."""
        return Path(next(iter(self.settings.values())).runs)

    @property
    def folders(self) -> dict[str, Path]:
        """The run folder of each talker."""
        return {name: run_folder(own, self.corpora[name].fingerprint) for name, own in self.settings.items()}


def planned(corpora: SeveralCorpora, given: Sequence[str]) -> Together:
    """The training that the overrides of a job describe.

    Raises:
        DnnvssError: a setting that is wrong, a corpus that is not there, or a system that talkers cannot share.
    """
    alone = {name: largest(run_settings(config)) for name, config in each_alone(corpora, given).items()}
    opened = {name: Corpus.open(own.corpus_folder) for name, own in alone.items()}
    return Together(joined(alone, {name: own.fingerprint for name, own in opened.items()}, corpora.balance), opened)


def train_together(corpora: SeveralCorpora, given: Sequence[str]) -> float:
    """Train what a job describes and return the mean of the talkers' correlations over speech.

    A training that was killed goes on where it stopped; talkers that are finished are only reported.

    Args:
        corpora: of the talkers.
        given: the overrides of the job.
    """
    training = planned(corpora, given)
    if process_number() > 0:
        end_with_parent()
        return _trained(training)
    name_parent()
    files.make_folder(training.folder.parent)
    with _reading(training), files.locked(training.folder, f"waiting for the command that trains {training.folder}"):
        return _trained(training)


@contextmanager
def _reading(training: Together) -> Iterator[None]:
    with ExitStack() as stack:
        for own in training.settings.values():
            stack.enter_context(reading(own.corpus_folder))
        yield


def _trained(training: Together) -> float:
    helper = process_number() > 0
    folders = training.folders
    if not helper:
        begin_together(training.folder, folders, next(iter(training.settings.values())).overwrite)
    settings = {name: replace(own, overwrite=False) for name, own in training.settings.items()}
    ended = {name: begin(folders[name], own, training.corpora[name], first=not helper)
             for name, own in settings.items()}
    if all(ended.values()):
        return _mean([told(RunFiles(folder)) for folder in folders.values()])
    materials = {name: gathered(own, training.corpora[name], folders[name]) for name, own in settings.items()}
    counts = ", ".join(f"{len(own.examples['train'])} utterances of {name}" for name, own in materials.items())
    print(f"training {next(iter(settings.values())).model_name} on {counts}; TensorBoard: "
          f"{RunFiles(training.folder).tensorboard}")
    fit = TogetherFit(materials, training.folder)
    models = fit.models()
    if helper:  # the first process of those that share the fit does the rest
        return math.nan
    found = []
    for name, material in materials.items():
        print(f"\n{name}, heard with {', '.join(settings[name].heard_with)}")
        found.append(told(RunFiles(folders[name])) if ended[name] else finished(
            folders[name], material, models[name], others=fit.others(name), without=partial(fit.part, name)))
    fit.end()
    print(f"\nwrote {training.folder}: runs of {', '.join(materials)}; speak with one by run={training.folder} "
          f"talker={next(iter(materials))}")
    return _mean(found)


def _mean(headlines: Sequence[float]) -> float:
    return sum(headlines) / len(headlines)
