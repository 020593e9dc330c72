"""A talker of minutes with the knowledge of others: adaptation by regression from what their systems say."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.features import FeatureTable
from dnnvss.files import digest
from dnnvss.settings import check_settings, setting
from dnnvss.systems.base import Example
from dnnvss.systems.ensemble import trajectory
from dnnvss.systems.kernel import KernelRegression, KernelSettings, described, squared_distances, typical_distance
from dnnvss.timing import FrameClock
from dnnvss.training.learnt import read_learnt

_REMEDY = "Name runs of other talkers: knowledge=runs/NAME"


@dataclass(frozen=True)
class SourceSettings:
    """A fitted system of another talker, with the labels and the clock of this one.

    Args:
        checkpoint: the file of what it learnt. It is read by a fit alone, which keeps a copy.
        digest: the SHA-256 of that file.
        model: its settings, as in a file of ``conf/model``.
    """

    checkpoint: str = setting(path=True)
    digest: str = setting()
    model: Mapping[str, Any] = setting()


@dataclass(frozen=True)
class AdaptedSettings(KernelSettings):
    """What a regression sees beside the phones: what other talkers would do."""

    sources: Mapping[str, SourceSettings] = setting({}, doc="name of each source; knowledge= fills it in")
    share: float = setting(0.5, least=0, most=1, doc="of the kernel that is the sources'; the rest is the phones'")
    around: tuple[float, ...] = setting((-0.08, -0.04, 0, 0.04, 0.08), least=-2, most=2,
                                        doc="seconds from the frame at which the sources are looked at")
    breadth: float = setting(1.5, above=0, doc="of the sources' kernel, in units of the typical distance of two frames")
    whitening: float = setting(0.3, least=0, most=1, doc="0: parameters of sources as large as they are, 1: all alike")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_settings(self, "model")
        from dnnvss.systems.registry import check_systems  # which imports every system

        check_systems({name: source.model for name, source in self.sources.items()}, "model.sources")


class AdaptedRegression(KernelRegression):
    """A Gaussian process over the phones around a frame and over what other talkers' systems say around it.

    Each source says the utterance on the face of its own talker; those parameters at some places around a frame, and
    the phones there, are what is seen of the frame. The kernel is a sum, ``k = (1 - s) k_phones + s k_sources``, each
    part a Gaussian as in :class:`KernelRegression`: sources know what follows from which phones in which context,
    few sentences tell what this talker makes of it, and where sources say nothing of use the phones are left.
    Nothing of the faces has to agree. The fitted system holds copies of its sources.

    **Source**: regression of the output, after Gales and Young, The application of hidden Markov models in speech
    recognition (2008), section 5; the sum of kernels: Rasmussen and Williams 2006, section 4.2.4.

    Args:
        table: the feature table of the labels, which is that of every source.
        clock: the trajectory clock, likewise.
        settings: see :class:`AdaptedSettings`.
    """

    system = "adapted"
    reads = frozenset({"phones", "words", "sound"})
    looks_up = frozenset()
    Settings = AdaptedSettings
    settings: AdaptedSettings

    def __init__(self, table: FeatureTable, clock: FrameClock, settings: AdaptedSettings | None = None) -> None:
        from dnnvss.systems.registry import make_system  # which imports every system

        super().__init__(table, clock, settings)
        self.sources = {name: make_system(str(source.model.get("name", name)), source.model, table, clock)
                        for name, source in self.settings.sources.items()}
        self.share = self.settings.share if "phones" in table.needs else 1.0

    def fit(self, train: Sequence[Example], val: Sequence[Example], folder: Path) -> None:
        """Read the sources and solve for the weights of the training frames.

        Raises:
            DnnvssError: there is no source, or one that is no longer what it was when the run was begun.
        """
        if not self.sources:
            raise DnnvssError("model=adapted has nobody to learn from", remedy=_REMEDY)
        for name, source in self.settings.sources.items():
            self.sources[name].load_state(_state(source))
        super().fit(train, val, folder)

    def seen(self, example: Example) -> np.ndarray:
        """What is seen of each frame (T, columns): of the phones first, then of each source at each place."""
        rate, said = float(self.clock.rate), [trajectory(s, example) for s in self.sources.values()]
        frames = np.arange(len(example.codes))
        around = [own[np.clip(frames + round(place * rate), 0, len(own) - 1)]
                  for own in said for place in self.settings.around]
        phones = [super().seen(example)] if self.share < 1 else []
        return np.concatenate([*phones, *around], axis=1)

    @property
    def _phones(self) -> int:
        """Columns that are of the phones."""
        s = self.settings
        return len(s.places) * described(s.identity, s.articulation).shape[1] if self.share < 1 else 0

    def state(self) -> dict[str, Any]:
        """What the regression learnt, and what the sources had learnt."""
        return {**super().state(), "scale": self.scale_,
                "sources": {name: source.state() for name, source in self.sources.items()}}

    def load_state(self, state: dict[str, Any]) -> None:
        """Take over what was learnt."""
        super().load_state(state)
        self.scale_ = state["scale"]
        for name, source in self.sources.items():
            source.load_state(state["sources"][name])

    def _measure(self, seen: np.ndarray) -> None:
        """Take the scale of each column, by which the kernels have a width of one."""
        s, n = self.settings, self._phones
        deviation = seen[:, n:].std(axis=0, dtype=np.float64)
        weight = np.maximum(deviation, 1e-6 * deviation.max(initial=1e-6)) ** s.whitening
        own = np.full(n, s.width * typical_distance(seen[:, :n]) if n else 1.0)
        others = weight * s.breadth * typical_distance(seen[:, n:] / weight)
        self.width_, self.scale_ = 1.0, np.concatenate([own, others])

    def _kernel(self, seen: np.ndarray) -> np.ndarray:
        here, there, n = seen / self.scale_, self.seen_ / self.scale_, self._phones
        others = _gaussian(here[:, n:], there[:, n:])
        if self.share == 1:
            return others
        return self.share * others + (1 - self.share) * _gaussian(here[:, :n], there[:, :n])


def _gaussian(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.exp(squared_distances(a, b) / -2)


def _state(source: SourceSettings) -> dict[str, Any]:
    """What a source had learnt.

    Raises:
        DnnvssError: its file is gone, damaged or another one.
    """
    path = Path(source.checkpoint)
    if not path.is_file() or digest(path) != source.digest:
        raise DnnvssError("is not what it was when this run was begun", file=path,
                          remedy="Begin the run anew: overwrite=true")
    state = read_learnt(path)["state"]
    assert isinstance(state, dict), path
    return state
