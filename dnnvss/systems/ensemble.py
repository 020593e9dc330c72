"""Systems of several kinds, and the mean of the trajectories that they say."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss.curves import STATIC_DELTA_DELTA2, derivatives, mlpg
from dnnvss.errors import DnnvssError
from dnnvss.face.base import Face
from dnnvss.features import FeatureTable
from dnnvss.settings import check_settings, setting
from dnnvss.systems.base import Example, Prediction, VisualModel
from dnnvss.systems.kernel import error_variance
from dnnvss.timing import FrameClock


@dataclass(frozen=True)
class EnsembleSettings:
    """Which systems are averaged, and what each of them sees.

    Args:
        systems: name to the settings of that system, as in its file of ``conf/model``.
        blocks: name of a system to the blocks of the labels that it sees; all of them where it is left out.
    """

    systems: Mapping[str, Mapping[str, Any]] = setting({}, doc="name of each system, and its settings")
    blocks: Mapping[str, tuple[str, ...]] = setting({}, doc="name of a system, and the blocks of labels that it sees")

    def __post_init__(self) -> None:
        check_settings(self, "model")
        from dnnvss.systems.registry import check_systems  # which imports every system

        check_systems(self.systems, "model.systems")
        if not self.systems:
            raise DnnvssError("model.systems={} is no ensemble", remedy="Name one system at least")
        if unknown := sorted(self.blocks.keys() - self.systems.keys()):
            raise DnnvssError(f"model.blocks.{unknown[0]} is of no system of the ensemble",
                              remedy=f"Name some of {', '.join(self.systems)}")


class Ensemble(VisualModel):
    """The mean of the trajectories of systems that learn in different ways.

    Pieces of recordings, trees and a kernel regression err in different places; where there is little to learn from,
    most of what each says wrongly is its own, and the mean of them is nearer to the talker than any one.

    Args:
        table: the feature table of the labels.
        clock: the trajectory clock.
        settings: see :class:`EnsembleSettings`.

    Raises:
        DnnvssError: a system that does not exist, or that refuses its settings or the labels; a block that the labels
            do not have.
    """

    system = "ensemble"
    reads = frozenset({"phones", "words"})
    looks_up = frozenset({"phones"})
    Settings = EnsembleSettings
    settings: EnsembleSettings

    def __init__(self, table: FeatureTable, clock: FrameClock, settings: EnsembleSettings | None = None) -> None:
        from dnnvss.systems.registry import make_system  # which imports every system

        super().__init__(table, clock, settings or EnsembleSettings({"codebook": {}, "hsmm": {}, "kernel": {}}))
        self.tables = {name: _narrowed(table, name, blocks) for name, blocks in self.settings.blocks.items()}
        self.systems = {name: make_system(name, own, self.tables.get(name, table), clock)
                        for name, own in self.settings.systems.items()}

    def take_face(self, face: Face) -> None:
        """Tell all systems."""
        for system in self.systems.values():
            system.take_face(face)

    def fit(self, train: Sequence[Example], val: Sequence[Example], folder: Path) -> None:
        """Fit all systems, each in a folder of its own; ``val`` gives the variance of the mean's errors."""
        for name, system in self.systems.items():
            system.fit([self._seen(name, e) for e in train], [self._seen(name, e) for e in val], folder / name)
        self.windows_ = STATIC_DELTA_DELTA2.first(train[0].measured[0].shape[1])
        self.variance_ = error_variance(self.streams, val or train)

    def predict(self, example: Example) -> Prediction:
        """Return the mean trajectory and its derivatives, with the error variance on the validation frames.

        Mean streams are derivatives of one another, so parameter generation returns the trajectory as it stands.
        """
        mean = self.streams(example)
        return Prediction(mean, np.broadcast_to(self.variance_, mean.shape))

    def streams(self, example: Example) -> np.ndarray:
        """The mean of the trajectories that the systems say by themselves, with its derivatives, (T, W, D)."""
        parts = [trajectory(system, self._seen(name, example)) for name, system in self.systems.items()]
        return derivatives(np.mean(parts, axis=0), self.windows_)

    def report(self, example: Example) -> dict[str, Any]:
        """Return what each system reports."""
        return {name: own for name, system in self.systems.items()
                if (own := system.report(self._seen(name, example)))}

    def phone_durations(self, example: Example) -> np.ndarray | None:
        """Return the mean of what those systems expect that learnt durations; None where none did."""
        known = [own for name, system in self.systems.items()
                 if (own := system.phone_durations(self._seen(name, example))) is not None]
        return np.mean(known, axis=0) if known else None

    def state(self) -> dict[str, Any]:
        """Return the states of the systems and the error variance."""
        return {"systems": {name: system.state() for name, system in self.systems.items()},
                "variance": self.variance_}

    def load_state(self, state: dict[str, Any]) -> None:
        """Take over the states of the systems and the error variance."""
        for name, system in self.systems.items():
            system.load_state(state["systems"][name])
        self.variance_ = state["variance"]
        self.windows_ = STATIC_DELTA_DELTA2.first(len(self.variance_))

    def _seen(self, name: str, example: Example) -> Example:
        """An example as a system sees it."""
        if name not in self.tables:
            return example
        return example.with_table(self.tables[name])


def _narrowed(table: FeatureTable, name: str, blocks: tuple[str, ...]) -> FeatureTable:
    """A table with some of its blocks.

    Raises:
        DnnvssError: it does not have one of them.
    """
    if missing := [block for block in blocks if block not in table.names]:
        raise DnnvssError(f"model.blocks.{name} names {missing[0]!r}, which {table.title} does not have",
                          remedy=f"Name some of {', '.join(table.names)}, or choose other labels")
    return FeatureTable(blocks, table.settings, table.title)


def trajectory(system: VisualModel, example: Example) -> np.ndarray:
    """What a system says by itself of an example, parameter generation included, (T, D) float64."""
    said = system.predict(example)
    windows = STATIC_DELTA_DELTA2.first(said.mean.shape[1])
    return np.asarray(mlpg(said.mean, said.variance, windows), dtype=np.float64)
