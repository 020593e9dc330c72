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
        network_settings(self.network)


@dataclass(frozen=True)
class NetworkSettings(MembersSettings):
    """The settings of :class:`~dnnvss.systems.network.NetworkModel`."""

    variances: bool = setting(False, doc="whether a second head predicts a variance for every frame and output")


def network_settings(network: Mapping[str, Any]) -> Any:
    """The settings of a network of any kind, read.

    Raises:
        DnnvssError: no such kind, or a setting that it refuses.
    """
    if network.get("kind") == "feedforward":
        own = {name: value for name, value in network.items() if name != "kind"}
        return read_settings(FeedForwardSettings, own, "model.network")
    from dnnvss.systems.frame_network import NetworkPlan  # loads torch

    return NetworkPlan.read(network).settings


def widest_layer(model: Mapping[str, Any]) -> int:
    """Inputs of the widest linear layer behind the first in the networks of a system; 0 where it has none.

    Args:
        model: the settings of a system, as in its file of ``conf/model``, or a part of them.
    """
    own = network_settings(model).widest if "kind" in model else 0
    return max([own, *(widest_layer(part) for part in model.values() if isinstance(part, Mapping))])
