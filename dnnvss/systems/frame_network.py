"""Networks from the columns of frames to outputs, by kind: frame by frame, or over time."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, ClassVar, TypeVar

import torch
from torch import Tensor, nn

from dnnvss.settings import read_settings, unknown_setting

Module = TypeVar("Module", bound=nn.Module)


class FrameNetwork(nn.Module):
    """A network from the columns of frames to their outputs.

    A subclass in a module of :mod:`dnnvss.systems` that declares ``kind`` is found by that name.
    It is built from the sizes ``binary``, ``numeric``, ``active`` and ``out``, and the fields of
    its ``Settings``. Of its modules, ``first`` is the layer that sees the columns and ``rest``
    everything behind it; those that see one frame at a time are the simplest kind.
    """

    kind: ClassVar[str]
    """Its name in YAML: ``model.network.kind``."""
    Settings: ClassVar[type[Any]]
    """A frozen dataclass of what YAML may set. It tells ``widest``: the inputs of the widest linear layer behind
    ``first``, by which the rate of AdamW may fall."""
    over_time: ClassVar[bool] = False
    """Whether an output depends on other frames of the utterance, so that whole ones are needed."""
    out: int
    """Outputs of a frame."""
    lookahead: int | None = 0
    """Frames behind its own that an output depends on; None for all of the utterance."""

    @property
    def reach(self) -> tuple[int, int]:
        """Frames before and after its own beyond which an output hardly depends on the inputs."""
        return 0, 0

    def forward(self, active: Tensor, numeric: Tensor, lengths: Any = None) -> Tensor:
        """Outputs (N, out) of active columns (N, A) and numbers (N, M).

        Args:
            active, numeric: of the frames of utterances, one behind the other.
            lengths: frames of each utterance; all of one where None. Networks that see one frame
                at a time do not heed them.
        """
        raise NotImplementedError

    def stream(self) -> "NetworkStream":
        """A new utterance whose frames arrive bit by bit."""
        return NetworkStream(self)


class NetworkStream:
    """Outputs while inputs arrive; this one is for networks that see one frame at a time."""

    def __init__(self, network: FrameNetwork) -> None:
        self.network = network

    def push(self, active: Tensor, numeric: Tensor) -> Tensor:
        """Outputs (n, out) of the frames that are settled once these (N, A) and (N, M) came in."""
        return self.network(active, numeric)

    def finish(self) -> Tensor:
        """Outputs (n, out) of the frames that were held back."""
        return torch.zeros(0, self.network.out)


def counts(lengths: Any, total: int) -> Sequence[int]:
    """Frames of each utterance as whole numbers; one of all frames where ``lengths`` is None."""
    if lengths is None:
        return [total]
    return lengths.tolist() if isinstance(lengths, Tensor) else list(lengths)


def filled(build: Callable[[], Module], weights: Mapping[str, Tensor]) -> Module:
    """A network with weights out of a file.

    It is built without memory first: a file or settings that ask for another size than the weights have, a giant one
    perhaps, cost nothing.

    Args:
        build: makes the network.
        weights: by name.

    Raises:
        ValueError: the network has other weights, or they are of another shape or kind.
    """
    with torch.device("meta"):
        wanted = {name: (weight.shape, weight.dtype) for name, weight in build().state_dict().items()}
    given = {name: (weight.shape, weight.dtype) for name, weight in weights.items()}
    if wrong := sorted(name for name in {*wanted, *given} if wanted.get(name) != given.get(name)):
        raise ValueError(f"its weights {wrong[0]} are not those of the network that the settings describe")
    network = build()
    network.load_state_dict(weights)
    return network


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
        """The plan that plain settings describe: ``kind`` and what that kind lets one set.

        Raises:
            DnnvssError: no such kind, or a setting that it refuses.
        """
        from dnnvss.systems.registry import declared, found

        kind = str(mapping.get("kind"))
        if (network := found(FrameNetwork, "kind", kind)) is None:
            raise unknown_setting(f"{where}.kind={kind}", [f"{where}.kind={k}" for k in declared(FrameNetwork, "kind")])
        own = {k: v for k, v in mapping.items() if k != "kind"}
        return cls(network, read_settings(network.Settings, own, where))

    def build(self, *, binary: int, numeric: int, active: int, out: int) -> FrameNetwork:
        """A new network with the weights that torch's seed gives."""
        own = {f.name: getattr(self.settings, f.name) for f in fields(self.settings)}
        return self.cls(binary=binary, numeric=numeric, active=active, out=out, **own)
