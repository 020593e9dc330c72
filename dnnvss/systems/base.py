"""What every system offers: a name, settings, what it reads; fit on examples, predict the streams of one."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from dnnvss.curves.passages import cut
from dnnvss.errors import DnnvssError
from dnnvss.face.base import Face
from dnnvss.features import FeatureTable, FrameCodes
from dnnvss.timing import Alignment, FrameClock


@dataclass(frozen=True)
class Example:
    """An utterance as a model sees it, on the trajectory clock.

    Args:
        id: the utterance.
        alignment: its tiers; ``phones`` spans the T frames.
        codes: frame codes of the labels, T frames.
        targets: static and derivative parameters (T, W, D) float32; None at synthesis.
        valid: (T,) bool, frames whose target was measured; None at synthesis.
        alternatives: other codes of the same frames that may be true as well, such as other dynamic visemes. Networks
            learn from all of them in turn, and average over all of them where they predict; other models heed
            ``codes`` alone.
        altered: codes of the same frames under an altered sound. Networks learn from them too; nobody predicts from
            them.
    """

    id: str
    alignment: Alignment
    codes: FrameCodes
    targets: np.ndarray | None = None
    valid: np.ndarray | None = None
    alternatives: tuple[FrameCodes, ...] = ()
    altered: tuple[FrameCodes, ...] = ()

    @property
    def further(self) -> tuple[FrameCodes, ...]:
        """What is learnt from in turn with ``codes``."""
        return self.alternatives + self.altered

    def with_table(self, table: FeatureTable) -> "Example":
        """The same asked for the columns of another table."""
        codes, *more = (codes.with_table(table) for codes in (self.codes, *self.further))
        count = len(self.alternatives)
        return replace(self, codes=codes, alternatives=tuple(more[:count]), altered=tuple(more[count:]))

    @property
    def measured(self) -> tuple[np.ndarray, np.ndarray]:
        """The targets and which of them are valid, of an example to learn from."""
        assert self.targets is not None and self.valid is not None, f"utterance {self.id} has no targets"
        return self.targets, self.valid


@dataclass(frozen=True)
class Prediction:
    """A Gaussian a frame: ``mean`` (T, W, D) and ``variance``, which broadcasts to it, in squared parameter units."""

    mean: np.ndarray
    variance: np.ndarray

    def part(self, around: slice) -> tuple[np.ndarray, np.ndarray]:
        """Mean and variance of a slice of the frames."""
        return self.mean[around], cut(self.variance, len(self.mean), around)


class PredictionStream(ABC):
    """Predictions while the frames of an utterance arrive."""

    @abstractmethod
    def push(self, active: np.ndarray, numeric: np.ndarray) -> Prediction:
        """The frames that are settled once the next ones came in, in order.

        Args:
            active: binary columns (n, A) of the frames, as :meth:`FrameCodes.active` gives them.
            numeric: numbers (n, N), as :meth:`FrameCodes.numeric` gives them.
        """

    @abstractmethod
    def finish(self) -> Prediction:
        """The frames that were held back, once the utterance has ended."""


READABLE = frozenset({"phones", "words", "visemes", "sound"})
"""What a system may read of an example."""


@dataclass(frozen=True)
class NoSettings:
    """The settings of a system that has none."""


class VisualModel(ABC):
    """A system that drives the face.

    A subclass in a module of :mod:`dnnvss.systems` that declares ``system`` is found by that name, see
    :mod:`dnnvss.systems.registry`; a file of ``conf/model`` gives it its settings.

    ``fit`` starts anew each time; what it learnt is in ``state``, plain containers and arrays only.

    Args:
        table: the feature table of the labels.
        clock: the trajectory clock.
        settings: an instance of ``Settings``; the defaults if left out.
    """

    system: ClassVar[str]
    """Its name in YAML."""
    reads: ClassVar[frozenset[str]]
    """Which of :data:`READABLE` make a difference to it."""
    looks_up: ClassVar[frozenset[str]] = frozenset()
    """Which of :data:`READABLE` it looks at in every example, whatever the labels are."""
    Settings: ClassVar[type[Any]] = NoSettings
    """A frozen dataclass of what YAML may set, see :mod:`dnnvss.settings`."""
    null: ClassVar[bool] = False
    """Whether it is a null model, which every evaluation shows beside the system."""

    def __init__(self, table: FeatureTable, clock: FrameClock, settings: Any = None) -> None:
        self.table, self.clock = table, clock
        self.settings: Any = self.Settings() if settings is None else settings

    def take_face(self, face: Face) -> None:
        """What a system has to know of the face whose parameters it predicts, before a fit; nothing by default."""
        del face

    face: Face | None = None
    """What the parameters move, where it is known: figures of a fit show it."""

    def shown_on(self, face: Face) -> None:
        """Let figures of a fit show a face; systems that this one is made of likewise."""
        self.face = face
        for value in vars(self).values():
            for part in value.values() if isinstance(value, dict) else (value,):
                if isinstance(part, VisualModel):
                    part.shown_on(face)

    @abstractmethod
    def fit(self, train: Sequence[Example], val: Sequence[Example], folder: Path) -> None:
        """Learn from the training examples; ``val`` chooses when to stop; ``folder`` keeps what a killed fit needs."""

    @abstractmethod
    def predict(self, example: Example) -> Prediction:
        """Return the predicted streams of one utterance."""

    def predictor(self, example: Example) -> Callable[[slice], tuple[np.ndarray, np.ndarray]]:
        """What gives mean and variance of slices of one utterance, in the memory of a slice where a system can."""
        return self.predict(example).part

    @property
    def lookahead(self) -> int | None:
        """Frames behind its own that a prediction depends on; None for all of the utterance."""
        return None

    def stream(self) -> PredictionStream:
        """A new utterance whose frames arrive bit by bit: what comes out is what :meth:`predict` says.

        Raises:
            DnnvssError: the system looks at the whole utterance.
        """
        raise DnnvssError(f"{type(self).__name__} looks at the whole utterance, so it cannot speak as the sound comes",
                          remedy="Train a network with a look-ahead: model=recurrent model.network.lookahead=10")

    def report(self, example: Example) -> dict[str, Any]:
        """Return how the prediction of an utterance came about, as plain containers; nothing where that is no help."""
        del example
        return {}

    def phone_durations(self, example: Example) -> np.ndarray | None:
        """Return the expected frames (S,) of each segment of the tier ``phones``; None if the model learnt none."""
        del example
        return None

    @abstractmethod
    def state(self) -> dict[str, Any]:
        """Return what was learnt as arrays and plain containers."""

    @abstractmethod
    def load_state(self, state: dict[str, Any]) -> None:
        """Take over what another instance had learnt."""


def pooled(examples: Sequence[Example]) -> np.ndarray:
    """Return the targets of all valid frames, shape (frames, W, D)."""
    return np.concatenate(list(_valid(examples)))


def _valid(examples: Sequence[Example]) -> Iterator[np.ndarray]:
    """Return the targets of each utterance's valid frames."""
    return (targets[valid] for targets, valid in (e.measured for e in examples))


def moments(examples: Sequence[Example]) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and standard deviation of the targets over all valid frames, both (W, D) float32.

    Utterance by utterance: a large corpus is never copied.
    """
    count = sum(len(part) for part in _valid(examples))
    mean = sum(part.sum(0, dtype=np.float64) for part in _valid(examples)) / count
    square = sum(((part - mean) ** 2).sum(0) for part in _valid(examples)) / count
    return mean.astype(np.float32), np.sqrt(square).astype(np.float32)
