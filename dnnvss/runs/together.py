"""Several talkers in one training: one fit, and a folder with a run of each."""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.runs.files import TogetherFiles
from dnnvss.runs.fitting import Material
from dnnvss.runs.folds import Examples, folded
from dnnvss.runs.knowledge import with_knowledge
from dnnvss.runs.naming import foreign, hash_of, named, what_counts
from dnnvss.runs.run import make_model
from dnnvss.runs.settings import RunSettings
from dnnvss.runs.talkers import TalkersIndex
from dnnvss.systems import VisualModel
from dnnvss.systems.network import NetworkModel
from dnnvss.systems.talkers import TalkersFit

_NAMED = 4
"""Talkers whose names stand in the name of the folder."""


def joined(settings: Mapping[str, RunSettings], fingerprints: Mapping[str, str],
           balance: float) -> dict[str, RunSettings]:
    """The settings of each talker's run in a training of all of them, in the folder of that training.

    Args:
        settings: of a run of each talker by itself, by the names of their corpora.
        fingerprints: of the corpora.
        balance: how much small talkers count, see :func:`dnnvss.systems.talkers.repeats`.

    Raises:
        DnnvssError: less than two talkers, a system that they cannot share, or labels that mean another thing to each.
    """
    if len(settings) < 2:
        raise DnnvssError(f"{len(settings)} corpus is no training of several talkers",
                          remedy=f"Use corpus={next(iter(settings), 'NAME')}, or name two at least: corpus=[a,b]")
    ordered = {name: with_knowledge(settings[name]) for name in sorted(settings)}
    for own in ordered.values():
        _check_shared(own)
    hashes = {name: hash_of(what_counts(own, fingerprints[name])) for name, own in ordered.items()}
    first = next(iter(ordered.values()))
    shown = "+".join([*list(ordered)[:_NAMED], *([str(len(ordered) - _NAMED)] if len(ordered) > _NAMED else [])])
    folder = first.run or str(Path(first.runs) / named(shown, first, hash_of([hashes, balance])))
    return {name: replace(own, run=None, runs=folder, balance=balance,
                          heard_with={other: digest for other, digest in hashes.items() if other != name})
            for name, own in ordered.items()}


def _check_shared(settings: RunSettings) -> None:
    """Refuse what several talkers cannot share."""
    model = make_model(settings, settings.task)
    if type(model) is not NetworkModel:
        raise DnnvssError(f"model={settings.model_name} is no network that several talkers can share",
                          remedy="Use model=feedforward, gaussian, recurrent or convolutional")
    if model.settings.fit.together and model.members > 1:
        raise DnnvssError("trainer.together stacks networks of one talker", remedy="Use trainer.together=false")
    if "visemes" in settings.task.table.sources:
        raise DnnvssError(f"labels={settings.labels_name} hold dynamic visemes, which each talker has of their own",
                          remedy="Use labels of phones or of the sound, such as labels=ph_d")


def begin_together(folder: Path, runs: Mapping[str, Path], overwrite: bool) -> None:
    """Take a folder for a training, or go on with it.

    Args:
        folder: of the training.
        runs: the run folder of each talker in it.
        overwrite: whether an older training there is deleted.

    Raises:
        DnnvssError: the folder holds something else, or a training with other talkers or settings.
    """
    places, index = TogetherFiles(folder), TalkersIndex({name: path.name for name, path in runs.items()})
    if folder.exists():
        if not places.index.is_file() and foreign(folder):
            raise DnnvssError("holds something that is not a training of several talkers", file=folder,
                              remedy="Name a folder that is empty or not there yet, or leave run= out")
        if overwrite:
            shutil.rmtree(folder)
        elif places.index.is_file() and (before := TalkersIndex.load(folder)) != index:
            raise DnnvssError(f"holds a training of {', '.join(before.talkers)} with other settings", file=folder,
                              remedy="Leave run= out or name another folder; overwrite=true deletes this one first")
    files.make_folder(folder)
    index.save(folder)


@dataclass
class TogetherFit:
    """The one fit of several talkers, and those that leave out a part of everybody's sentences.

    Args:
        materials: of each talker.
        folder: of the training.
    """

    materials: Mapping[str, Material]
    folder: Path
    _parts: dict[int, dict[str, NetworkModel]] = field(default_factory=dict)

    def models(self) -> dict[str, NetworkModel]:
        """The system of each talker, fitted on the training sentences of all."""
        return self._fit({name: own.examples for name, own in self.materials.items()}, self.folder)

    def part(self, talker: str, k: int) -> VisualModel:
        """The system of a talker that was fitted without part ``k`` of the sentences of every talker.

        Talkers with a test split are as they are in every part.
        """
        if k not in self._parts:
            left = {name: folded(own.examples["test"], own.folds)[k % own.folds] if own.folds else own.examples
                    for name, own in self.materials.items()}
            self._parts[k] = self._fit(left, TogetherFiles(self.folder).parts / str(k + 1))
        return self._parts[k][talker]

    def others(self, talker: str) -> Sequence[Material]:
        """What was heard beside a talker."""
        return [own for name, own in self.materials.items() if name != talker]

    def end(self) -> None:
        """Delete what only a fit that was killed would need."""
        shutil.rmtree(TogetherFiles(self.folder).parts, ignore_errors=True)

    def _fit(self, examples: Mapping[str, Examples], folder: Path) -> dict[str, NetworkModel]:
        first = next(iter(self.materials.values()))
        model = make_model(first.settings, first.settings.task)
        fit = TalkersFit(model.table, model.clock, model.settings, first.settings.balance,
                          {name: own.encoded.face for name, own in self.materials.items()})
        train, val = ({name: own[kind] for name, own in examples.items()} for kind in ("train", "val"))
        return fit(train, val, folder)
