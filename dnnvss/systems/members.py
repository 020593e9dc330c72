"""The settings of networks that are fitted one after the other, read without torch where their kind needs none."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from dnnvss.settings import check_settings, read_settings, setting
from dnnvss.systems.layers import FeedForwardSettings
from dnnvss.training.settings import FitSettings


@dataclass(frozen=True)
class MembersSettings:
    """Networks of one kind, fitted one after the other."""

    network: Mapping[str, Any] = setting({"kind": "feedforward"}, doc="its kind, and what that kind lets one set")
    fit: FitSettings = field(default_factory=FitSettings)
    members: int = setting(1, least=1, doc="networks of different seeds that are fitted and averaged")

    def __post_init__(self) -> None:
        check_settings(self, "model")
        _check(self.network)


@dataclass(frozen=True)
class NetworkSettings(MembersSettings):
    """The settings of :class:`~dnnvss.systems.network.NetworkModel`."""

    variances: bool = setting(False, doc="whether a second head predicts a variance for every frame and output")


def _check(network: Mapping[str, Any]) -> None:
    """Refuse a kind of network that does not exist, or a setting that it refuses."""
    if network.get("kind") == "feedforward":
        own = {name: value for name, value in network.items() if name != "kind"}
        read_settings(FeedForwardSettings, own, "model.network")
        return
    from dnnvss.systems.frame_network import NetworkPlan  # loads torch

    NetworkPlan.read(network)
