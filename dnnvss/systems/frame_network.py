"""Networks that see one frame at a time, by kind."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar

from torch import Tensor, nn

from dnnvss.settings import read_settings, unknown_setting


class FrameNetwork(nn.Module):
    """A network from the columns of a frame to its outputs.

    A subclass in a module of :mod:`dnnvss.systems` that declares ``kind`` is found by that name. It is built from the
    sizes ``binary``, ``numeric``, ``active`` and ``out``, and the fields of its ``Settings``.
    """

    kind: ClassVar[str]
    """Its name in YAML: ``model.network.kind``."""
    Settings: ClassVar[type[Any]]
    """A frozen dataclass of what YAML may set."""

    def forward(self, active: Tensor, numeric: Tensor) -> Tensor:
        """Outputs (B, out) of active columns (B, A) and numbers (B, N)."""
        raise NotImplementedError


@dataclass(frozen=True)
class NetworkPlan:
    """A network that can be built as often as is wanted.

    Args:
        cls: its class.
        settings: an instance of the class's ``Settings``.
    """

    cls: type[FrameNetwork]
    settings: Any

    @classmethod
    def read(cls, mapping: Mapping[str, Any], where: str = "model.network") -> "NetworkPlan":
        """The plan that plain settings describe: ``kind`` and what that kind of network lets one set.

        Raises:
            DnnvssError: no such kind, or a setting that it refuses.
        """
        from dnnvss.systems.registry import declared

        kind, known = str(mapping.get("kind")), declared(FrameNetwork, "kind")
        if kind not in known:
            raise unknown_setting(f"{where}.kind={kind}", [f"{where}.kind={other}" for other in known])
        own = {k: v for k, v in mapping.items() if k != "kind"}
        return cls(known[kind], read_settings(known[kind].Settings, own, where))

    def build(self, *, binary: int, numeric: int, active: int, out: int) -> FrameNetwork:
        """A new network with the weights that torch's seed gives."""
        own = {f.name: getattr(self.settings, f.name) for f in fields(self.settings)}
        return self.cls(binary=binary, numeric=numeric, active=active, out=out, **own)
