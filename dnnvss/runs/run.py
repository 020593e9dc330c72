"""A trained system, opened for use, with everything that belongs to it."""

import platform
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dnnvss import __version__, files
from dnnvss.corpus import Corpus, Utterance
from dnnvss.errors import DnnvssError
from dnnvss.face.base import Face
from dnnvss.face.kinds import load_face
from dnnvss.life import Life
from dnnvss.media import Sound
from dnnvss.render.living import LivingPicture, living_picture
from dnnvss.render.pictures import Pictures, open_pictures
from dnnvss.runs.bundle import BundleIndex, is_bundle
from dnnvss.runs.files import Provenance, RunFiles
from dnnvss.runs.heard import Heard
from dnnvss.runs.settings import RunSettings
from dnnvss.runs.trial import trial
from dnnvss.runs.voice import Voice
from dnnvss.shortages import shortage_of
from dnnvss.speech.durations import DurationModel
from dnnvss.style import Talker
from dnnvss.style.generator import Generator
from dnnvss.systems import Example, VisualModel
from dnnvss.systems.examples import Task
from dnnvss.systems.plain_network import PlainNetwork
from dnnvss.training.arrays import load_arrays, save_arrays
from dnnvss.training.learnt import read_learnt
from dnnvss.visemes import TIER

if TYPE_CHECKING:
    from dnnvss.systems.viseme_predictor import UnitModel

_ANEW = "Train the run anew: dnnvss train overwrite=true"
_PACKAGES = ("torch", "lightning", "numpy", "scipy", "hydra-core", "av", "pocketsphinx")


def provenance(settings: RunSettings, fingerprint: str) -> Provenance:
    """Versions of the code and its main dependencies, the fingerprint of the data, and the number format."""
    from dnnvss.training.precision import resolve

    versions = {name: metadata.version(name) for name in _PACKAGES}
    precision = resolve(settings.trainer["precision"], settings.trainer["accelerator"])
    others = tuple(settings.heard_with)
    return Provenance(__version__, platform.python_version(), versions, fingerprint, precision, others)


@dataclass(frozen=True)
class Run:
    """A trained system, opened for use.

    Args:
        folder: of the run, or a bundle.
        settings: that it was trained with.
        model: the system, as far as it is needed to speak: a network that sees one frame at a time is opened without
            torch.
        width: how many parameters it predicts; None where that is not known before it is asked.
    """

    folder: Path
    settings: RunSettings
    model: VisualModel
    width: int | None = None

    @property
    def files(self) -> RunFiles:
        """Where everything of the run lies."""
        return RunFiles(self.folder)

    @property
    def task(self) -> Task:
        """Labels, clock and streams."""
        return self.settings.task

    @property
    def needs(self) -> frozenset[str]:
        """What an utterance must have: some of ``phones``, ``words``, ``visemes`` and ``sound``."""
        return self.task.table.needs | self.model.looks_up

    @cached_property
    def trained(self) -> VisualModel:
        """The system with all that it can do, such as being exported."""
        return _trained(self.files.model, self.settings) if isinstance(self.model, PlainNetwork) else self.model

    @cached_property
    def face(self) -> Face:
        """The face whose parameters the system predicts."""
        return load_face(self.files.face)

    def pictures(self, scale: float = 1.0) -> Pictures:
        """What draws the face, in its own surroundings where it has texture.

        Args:
            scale: size of the pictures over their usual size.
        """
        return self._pictures if scale == 1 else open_pictures(self.face, self.files.picture, scale)

    @cached_property
    def _pictures(self) -> Pictures:
        """Those of the usual size, made once for all that is said: they hold no more than what is drawn with."""
        return open_pictures(self.face, self.files.picture)

    @cached_property
    def life(self) -> Life | None:
        """How the talker's eyes and head move beside speech; None where that was not learnt."""
        return Life.load(self.files.life) if self.files.life.is_file() else None

    def living(self, scale: float = 1.0) -> LivingPicture | None:
        """What draws the talker's life over the face's pictures, None where none was learnt.

        Args:
            scale: as for :meth:`pictures`.
        """
        if self.life is None:
            return None
        return self._living if scale == 1 else living_picture(self.face, self.files.picture, self.life, scale)

    @cached_property
    def _living(self) -> LivingPicture | None:
        return None if self.life is None else living_picture(self.face, self.files.picture, self.life)

    @cached_property
    def generator(self) -> Generator:
        """What turns examples into trajectories, with what was learnt of the talker."""
        talker = Talker.load(self.files.talker)
        count = len(self.face.names)
        for known, file in ((len(talker.natural), self.files.talker), (self.width, self.files.model)):
            if known not in (None, count):
                raise DnnvssError(f"knows {known} coefficients, and the face has {count}", file=file, remedy=_ANEW)
        return Generator(self.task, self.model, talker)

    @cached_property
    def durations(self) -> DurationModel:
        """How long the talker's phones last."""
        return DurationModel.load(self.files.durations)

    @cached_property
    def voice(self) -> Voice:
        """What the talker said, and how."""
        return Voice.load(self.files.voice)

    @cached_property
    def heard(self) -> Heard | None:
        """What the run has heard, None where its labels do not read the sound."""
        return Heard.load(self.files.heard) if "sound" in self.task.table.needs else None

    @cached_property
    def units(self) -> "UnitModel | None":
        """The dynamic visemes of the run and their predictor, None where its labels have none."""
        if "visemes" not in self.task.table.sources:
            return None
        from dnnvss.systems.viseme_predictor import UnitModel  # a network

        return UnitModel.load(self.files.bundled_units if is_bundle(self.folder) else self.files.units)

    def example(self, utterance: Utterance, sound: Sound | None = None) -> Example:
        """An utterance as the model sees it; where it has no tier ``visemes``, that is predicted from text.

        Args:
            utterance: with the tiers ``phones`` and ``words``.
            sound: what is heard; needed where the labels read it.
        """
        if self.units is None or TIER in utterance.alignment:
            return self.task.example(utterance, sound=sound)
        return self.task.example(utterance, visemes=self.units.tiers(utterance), sound=sound)

    def recorded(self, corpus: Corpus, utterance: Utterance) -> Example:
        """An utterance of a corpus as the model sees it, with the recorded sound where the labels read it."""
        return self.example(utterance, self.task.sound(corpus, utterance))

    @staticmethod
    def save(folder: Path, task: Task, model: VisualModel) -> None:
        """Write what the system learnt: arrays and plain containers, whole or not at all."""
        path = RunFiles(folder).model.with_suffix(".npz")
        save_arrays(path, {"table": task.table.describe(), "state": model.state()})

    @classmethod
    def open(cls, folder: Path) -> "Run":
        """The run in a folder, or in a bundle.

        Raises:
            DnnvssError: the folder holds no finished run, its checkpoint is damaged, or it was trained with another
                feature table than its configuration now builds.
        """
        places = RunFiles(folder)
        for path in (places.index, places.provenance, places.model, places.units, *places.members):
            files.inside(folder, path.name)
        settings = RunSettings.load(folder)
        kept = BundleIndex.load(folder).check(folder) if is_bundle(folder) else places.model
        model = _exported(kept, settings) if kept.suffix == ".onnx" else _opened(kept, settings)
        return cls(folder, settings, model, _tried(kept, model, settings))


def _exported(path: Path, settings: RunSettings) -> VisualModel:
    """The network of a bundle."""
    from dnnvss.export.exported import ExportedModel

    network = ExportedModel.open(path)
    settings.task.table.check(network.table.describe())
    return network


def _opened(path: Path, settings: RunSettings) -> VisualModel:
    """The system of a run folder as far as it is needed to speak."""
    if path.suffix == ".npz" and path.is_file() and PlainNetwork.serves(settings.model):
        with _learnt_by(settings, path):
            kept = _checked(load_arrays(path), settings, path)
            if (plain := PlainNetwork.of(settings.model, settings.task.table, settings.task.clock, kept)) is not None:
                return plain
    return _trained(path, settings)


def _trained(path: Path, settings: RunSettings) -> VisualModel:
    """The system of a run folder, with what it learnt."""
    folder = path.parent
    if not path.is_file():
        raise DnnvssError("holds a run that has not ended", file=folder,
                          remedy="Run its command (dnnvss train) again: it goes on where it stopped")
    learnt = read_learnt(path)
    model = make_model(settings, settings.task)
    with _learnt_by(settings, path):
        model.load_state(_checked(learnt, settings, path))
    return model


def _checked(kept: Mapping[str, Any], settings: RunSettings, path: Path) -> dict[str, Any]:
    """What a system had learnt, of a file that holds the columns that the settings make.

    Raises:
        DnnvssError: it holds something else.
    """
    table, state = kept.get("table"), kept.get("state")
    if not isinstance(table, dict) or not isinstance(state, dict):
        raise DnnvssError("is no system of this package", file=path, remedy="Train a system: dnnvss train")
    settings.task.table.check(table)
    return state


def _tried(path: Path, model: VisualModel, settings: RunSettings) -> int | None:
    """How many parameters a system predicts; it is asked for a second of speech."""
    with _learnt_by(settings, path):
        found = trial(model, settings.task)
    return None if found is None else found.mean.shape[2]


@contextmanager
def _learnt_by(settings: RunSettings, path: Path) -> Iterator[None]:
    """Say of a file that it does not hold what its system learns, whatever the system trips over."""
    try:
        yield
    except DnnvssError as error:
        raise DnnvssError(error.problem, file=path, remedy=error.remedy) from error
    except Exception as error:  # each library has errors of its own for numbers that do not fit
        if (short := shortage_of(error, path)) is not None:
            raise short from error
        said = " ".join(f"{type(error).__name__}: {error}".split())[:300]
        raise DnnvssError(f"does not hold what {settings.model_name} learns ({said})", file=path,
                          remedy=_ANEW) from error


def make_model(settings: RunSettings, task: Task) -> VisualModel:
    """The untrained model that settings describe, for a task.

    Raises:
        DnnvssError: what :func:`dnnvss.systems.registry.make_system` refuses.
    """
    from dnnvss.systems.registry import make_system  # which imports every system

    return make_system(settings.model_name, settings.model, task.table, task.clock)
