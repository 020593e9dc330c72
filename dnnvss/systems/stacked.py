"""Several networks of one size as one, their matrices stacked."""

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from dnnvss.errors import DnnvssError
from dnnvss.systems.feedforward import FeedForward, left_out
from dnnvss.training.code_product import code_product, multiplies
from dnnvss.training.code_sum import code_sum


class StackedNetworks(nn.Module):
    """Feed-forward networks that are trained in one pass, each on frames of its own.

    A small network leaves most of a GPU idle; eight of them, one batched product a layer, take little longer than one.
    Frames lie one network behind the other: the first part of a batch belongs to the first network, and so do the first
    outputs.

    Args:
        networks: of one shape; their weights are copied.

    Raises:
        DnnvssError: one of them is no :class:`FeedForward`.
    """

    def __init__(self, networks: Sequence[nn.Module]) -> None:
        super().__init__()
        first = networks[0]
        if not isinstance(first, FeedForward):
            raise DnnvssError("trainer.together works for feed-forward networks alone",
                              remedy="Use trainer.together=false")
        self.members = len(networks)
        names = [name for name, _ in first.named_parameters()]
        self.stacks = nn.ParameterDict({
            _key(name): torch.stack([network.get_parameter(name).detach() for network in networks]) for name in names})
        self.input_dropout = first.first.dropout
        self.elementwise = nn.ModuleDict({str(i): layer for i, layer in enumerate(first.rest)
                                          if not isinstance(layer, nn.Linear)})
        self.depth = len(first.rest)

    @property
    def matrices(self) -> dict[nn.Parameter, int]:
        """The stacked weights of linear layers and how many inputs a unit has."""
        return {stack: stack.shape[-1] for name, stack in self.stacks.items()
                if name.startswith("rest/") and name.endswith("/weight")}

    def unstack(self, networks: Sequence[nn.Module]) -> None:
        """Copy the weights back."""
        for k, network in enumerate(networks):
            network.load_state_dict({name: self.stacks[_key(name)][k] for name, _ in network.named_parameters()})

    def forward(self, active: Tensor, numeric: Tensor) -> Tensor:
        """Return the outputs (K x B, out) of columns (K x B, A) and numbers (K x B, N)."""
        active, numeric = (part.unflatten(0, (self.members, -1)) for part in (active, numeric))
        x = self._first(active, numeric)
        for place in range(self.depth):
            if str(place) in self.elementwise:
                x = self.elementwise[str(place)](x)
            else:
                weight, bias = self._stacked(f"rest.{place}", "weight", "bias")
                x = torch.baddbmm(bias[:, None], x, weight.mT)
        return x.flatten(0, 1)

    def _first(self, active: Tensor, numeric: Tensor) -> Tensor:
        weight, other, bias = self._stacked("first", "weight", "numeric_weight", "bias")
        if self.training:
            active = left_out(active, self.input_dropout, weight.shape[1] - 1)
        if multiplies(weight):
            return code_product(active, numeric, weight, other, bias)
        sums = torch.stack([code_sum(a, w) for a, w in zip(active, weight.unbind(), strict=True)])
        return torch.baddbmm(sums + bias[:, None], numeric, other)

    def _stacked(self, layer: str, *names: str) -> list[Tensor]:
        return [self.stacks[_key(f"{layer}.{name}")] for name in names]


def _key(name: str) -> str:
    return name.replace(".", "/")  # names of parameters must not hold a dot
