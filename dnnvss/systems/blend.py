"""Two networks that see different labels, and the mean of what they say."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss.features import FeatureTable
from dnnvss.settings import setting
from dnnvss.systems.base import READABLE, Example, Prediction, VisualModel
from dnnvss.systems.members import MembersSettings, NetworkSettings
from dnnvss.systems.network import NetworkModel
from dnnvss.timing import FrameClock


def without_visemes(table: FeatureTable) -> FeatureTable:
    """Return the table without its blocks of dynamic visemes.

    Raises:
        DnnvssError: nothing is left.
    """
    return FeatureTable(tuple(b.name for b in table.blocks if "visemes" not in b.reads), table.settings)


@dataclass(frozen=True)
class BlendSettings(MembersSettings):
    """The settings of :class:`BlendedNetworks`; there are ``members`` of each kind."""

    weight: float = setting(0.5, least=0, most=1, doc="of the networks that see all labels")


class BlendedNetworks(VisualModel):
    """The weighted mean of a network that sees all labels and one that sees no dynamic visemes.

    Dynamic visemes that are predicted from text make movements as large as the talker's and are wrong now and then;
    phones are always right and say less. Where the labels have no dynamic visemes the two networks differ in their
    seeds alone: that is what the blend has to be compared with.

    Args:
        table: the feature table of the labels.
        clock: the trajectory clock.
        settings: see :class:`BlendSettings`; seeds go on counting from one fit to the other.

    Raises:
        DnnvssError: what :class:`NetworkModel` refuses, or labels of dynamic visemes alone.
    """

    system = "blend"
    reads = READABLE
    Settings = BlendSettings
    settings: BlendSettings

    def __init__(self, table: FeatureTable, clock: FrameClock, settings: BlendSettings | None = None) -> None:
        super().__init__(table, clock, settings)
        own, s = NetworkSettings(self.settings.network, self.settings.fit, self.settings.members), self.settings
        self.weight, self.phone_table = s.weight, without_visemes(table)
        self.phones = NetworkModel(self.phone_table, clock, own)
        self.all = NetworkModel(table, clock, replace(own, fit=replace(s.fit, seed=s.fit.seed + s.members)))

    def fit(self, train: Sequence[Example], val: Sequence[Example], folder: Path) -> None:
        """Fit both networks, each with its own early stopping; a killed fit goes on where it was."""
        self.phones.fit([self._phones(e) for e in train], [self._phones(e) for e in val], folder / "phones")
        self.all.fit(train, val, folder / "all")
        known = [(self._mean(e), *e.measured) for e in val]
        errors = [(mean - targets)[valid] for mean, targets, valid in known]
        self.variance_ = np.concatenate(errors).astype(np.float64).var(0) + 1e-12

    def predict(self, example: Example) -> Prediction:
        """Return the mean streams of both and the error variance of that mean on the validation frames."""
        mean = self._mean(example)
        return Prediction(mean, np.broadcast_to(self.variance_, mean.shape))

    def state(self) -> dict[str, Any]:
        """Return the states of both networks and the error variance."""
        return {"phones": self.phones.state(), "all": self.all.state(), "variance": self.variance_}

    def load_state(self, state: dict[str, Any]) -> None:
        """Take over the states of both networks and the error variance."""
        self.phones.load_state(state["phones"])
        self.all.load_state(state["all"])
        self.variance_ = state["variance"]

    def _mean(self, example: Example) -> np.ndarray:
        phones, every = self.phones.predict(self._phones(example)).mean, self.all.predict(example).mean
        return (1 - self.weight) * phones + self.weight * every

    def _phones(self, example: Example) -> Example:
        return replace(example, alternatives=()).with_table(self.phone_table)
