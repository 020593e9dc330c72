"""Where everything lies in a run folder, and in a bundle, which has the same names for what both have."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from dnnvss.records import read_record


@dataclass(frozen=True)
class Provenance:
    """What ``run.json`` says.

    Args:
        dnnvss, python, packages: versions of what the run was begun with.
        corpus: the fingerprint of what it is trained on.
        precision: the number format.
        heard_with: the other talkers of the same training, by the names of their corpora; none where there were none.
    """

    dnnvss: str = ""
    python: str = ""
    packages: Mapping[str, str] = field(default_factory=dict)
    corpus: str = ""
    precision: str = ""
    heard_with: tuple[str, ...] = ()


@dataclass(frozen=True)
class RunFiles:
    """The paths of a run folder; nothing else in the package spells them.

    What the fit of a network needs to go on (``checkpoints``, ``tensorboard``) is the engine's own, under the folder.

    Args:
        folder: of the run.
    """

    folder: Path

    @property
    def config(self) -> Path:
        """The settings that the run was trained with."""
        return self.folder / "config.yaml"

    @property
    def provenance(self) -> Path:
        """Versions, the fingerprint of the corpus and the number format; the first sign of a run."""
        return self.folder / "run.json"

    def written(self) -> "Provenance":
        """What :attr:`provenance` says.

        Raises:
            DnnvssError: it is missing or damaged.
        """
        return read_record(Provenance, self.provenance, "Delete the folder, or train the run anew with overwrite=true")

    @property
    def model(self) -> Path:
        """What the system learnt, as arrays; there once the fit has ended."""
        made, older = self.folder / "model.npz", self.folder / "model.pt"  # as runs of before have it
        return older if older.is_file() and not made.is_file() else made

    @property
    def units(self) -> Path:
        """The dynamic visemes and their predictor, where the labels have some."""
        return self.folder / "units.pt"

    @property
    def bundled_units(self) -> Path:
        """The same in a bundle, as arrays."""
        return self.folder / "units.npz"

    @property
    def unit_scores(self) -> Path:
        """How well dynamic visemes are predicted."""
        return self.folder / "units.json"

    @property
    def face(self) -> Path:
        """The face whose parameters the system predicts."""
        return self.folder / "face.npz"

    @property
    def picture(self) -> Path:
        """The picture of the talker that the face is drawn into, where it has texture."""
        return self.folder / "neutral.npz"

    @property
    def life(self) -> Path:
        """How the talker's eyes and head move beside speech, where the face has a picture and landmarks of eyes."""
        return self.folder / "life.npz"

    @property
    def talker(self) -> Path:
        """What styles know of the talker's movement."""
        return self.folder / "talker.npz"

    @property
    def durations(self) -> Path:
        """How long the talker's phones last."""
        return self.folder / "durations.npz"

    @property
    def voice(self) -> Path:
        """What the talker said, and how: see :class:`dnnvss.runs.voice.Voice`."""
        return self.folder / "voice.json"

    @property
    def heard(self) -> Path:
        """What its training sounds were like, where the labels read the sound."""
        return self.folder / "heard.npz"

    @property
    def metrics(self) -> Path:
        """The numbers of the evaluation; written last, so that a run that has them is finished."""
        return self.folder / "metrics.json"

    @property
    def page(self) -> Path:
        """The tables of the evaluation."""
        return self.folder / "metrics.md"

    @property
    def viewing(self) -> Path:
        """What viewers gave the run, where it was part of a viewing test that has been analysed."""
        return self.folder / "viewing.json"

    @property
    def unseen_words(self) -> Path:
        """The numbers inside words that no training sentence holds, where there are some."""
        return self.folder / "metrics_unseen_words.json"

    @property
    def predictions(self) -> Path:
        """The folder of :meth:`prediction`."""
        return self.folder / "predictions"

    @property
    def parts(self) -> Path:
        """What systems need to go on that are fitted without a part of the sentences; there until the evaluation."""
        return self.folder / "parts"

    @property
    def choice(self) -> Path:
        """How the system was chosen, where it was: see :class:`dnnvss.evaluation.choice.Choice`."""
        return self.folder / "choice.json"

    @property
    def verdict(self) -> Path:
        """What the run is worth and what to record next, in five lines."""
        return self.folder / "verdict.html"

    @property
    def sample(self) -> Path:
        """A test sentence as a video."""
        return self.folder / "sample.mp4"

    @property
    def tensorboard(self) -> Path:
        """The curves of the fit."""
        return self.folder / "tensorboard"

    @property
    def comparison(self) -> Path:
        """The folder of a comparison with other runs."""
        return self.folder / "evaluation"

    @property
    def outside(self) -> Path:
        """What a tracker of its own saw in the run's videos: see :mod:`dnnvss.evaluation.outside`."""
        return self.comparison / "outside.json"

    @property
    def unheard(self) -> Path:
        """What it says of words it never heard: see :mod:`dnnvss.evaluation.unseen`."""
        return self.comparison / "unseen.json"

    @property
    def index(self) -> Path:
        """What makes a folder a bundle; written last."""
        return self.folder / "bundle.json"

    def prediction(self, kind: str) -> Path:
        """Arrays of the test sentences by id: ``predicted``, ``reference``, ``speech``, ``valid``."""
        return self.predictions / f"{kind}.npz"

    def styled(self) -> dict[str, Path]:
        """The trajectories of the test sentences in each style, or from each other source, by its name."""
        paths = sorted(self.predictions.glob("predicted_*.npz"))
        return {path.stem.removeprefix("predicted_"): path for path in paths}

    def figure(self, name: str) -> Path:
        """A plot of the evaluation."""
        return self.folder / "figures" / f"{name}.png"

    def video(self, sentence: str) -> Path:
        """A test sentence beside its recording."""
        return self.folder / "videos" / f"{sentence}.mp4"

    @property
    def needed(self) -> tuple[Path, ...]:
        """What synthesis always needs, beside the model."""
        return self.config, self.face, self.talker, self.durations, self.voice

    @property
    def members(self) -> tuple[Path, ...]:
        """What synthesis may read of a bundle, beside the model."""
        return *self.needed, self.picture, self.life, self.bundled_units, self.heard

    @property
    def finished(self) -> bool:
        """Whether the run has been evaluated."""
        return self.metrics.is_file()


@dataclass(frozen=True)
class TogetherFiles:
    """The paths of a training of several talkers: a folder of run folders, one of each talker.

    Args:
        folder: of the training.
    """

    folder: Path

    @property
    def index(self) -> Path:
        """Whose runs lie here, and where; the first sign of such a training."""
        return self.folder / "talkers.json"

    @property
    def parts(self) -> Path:
        """What the fits that leave a part of all talkers' sentences out need to go on; there until the evaluation."""
        return self.folder / "parts"
