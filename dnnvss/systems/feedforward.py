"""The feed-forward network of Thangthai et al. 2016, section 2."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import torch
from torch import Tensor, nn

from dnnvss.systems.frame_network import FrameNetwork
from dnnvss.systems.layers import FeedForwardSettings
from dnnvss.training.brief import Linear, Tanh
from dnnvss.training.code_product import code_product, multiplies
from dnnvss.training.code_sum import code_sum
from dnnvss.training.dropout import Dropout

ACTIVATIONS: dict[str, Callable[[], nn.Module]] = {"tanh": Tanh, "sigmoid": nn.Sigmoid, "relu": nn.ReLU}


class CodeLinear(nn.Module):
    """A linear layer whose binary inputs come as the indices of the active columns.

    Equal to ``dense @ weight + numeric @ numeric_weight + bias``, at the cost of the active columns only; or that very
    product, where the device does it faster.

    Args:
        binary: number of binary columns; index ``binary`` is padding.
        numeric: number of numeric columns.
        out: number of units.
        dropout: share of the active columns left out in training.
    """

    def __init__(self, binary: int, numeric: int, out: int, dropout: float = 0.0) -> None:
        super().__init__()
        self.dropout = dropout
        self.weight = nn.Parameter(torch.zeros(binary + 1, out))
        self.numeric_weight = nn.Parameter(torch.zeros(numeric, out))
        self.bias = nn.Parameter(torch.zeros(out))

    @torch.no_grad()
    def reset(self, active: int) -> None:
        """Draw weights for inputs of which about ``active`` are on at a time (uniform, Glorot)."""
        fan_in = active + self.numeric_weight.shape[0]
        bound = (6 / (fan_in + self.bias.numel())) ** 0.5
        self.weight.uniform_(-bound, bound)[-1] = 0
        self.numeric_weight.uniform_(-bound, bound)
        self.bias.zero_()

    def forward(self, active: Tensor, numeric: Tensor) -> Tensor:
        """Return (B, out) for active column indices (B, A) and normalised numeric inputs (B, N)."""
        if self.training:
            active = left_out(active, self.dropout, self.weight.shape[0] - 1)
        if multiplies(self.weight):
            return code_product(active, numeric, self.weight, self.numeric_weight, self.bias)
        return torch.addmm(code_sum(active, self.weight) + self.bias, numeric, self.numeric_weight)


def left_out(active: Tensor, share: float, padding: int) -> Tensor:
    """Return active columns with a share of them, drawn at random, replaced by padding."""
    if not share:
        return active
    return torch.where(torch.rand(active.shape, device=active.device) >= share, active, padding)


class FeedForward(FrameNetwork):
    """Hidden layers with one activation and dropout, and a linear output.

    **Source**: Thangthai et al. 2016, sections 2 and 5 (3 x 3000 tanh, 50 % dropout on hidden units).

    Args:
        binary, numeric: input columns, from the feature table.
        active: how many binary columns are on in a frame, for the scale of the first layer's weights.
        out: output values a frame, W x D.
        hidden: width of each hidden layer.
        activation: ``tanh``, ``sigmoid`` or ``relu``.
        dropout: share of hidden units dropped in training.
        input_dropout: share of active binary inputs dropped in training.

    Raises:
        DnnvssError: what :class:`FeedForwardSettings` refuses.
    """

    kind = "feedforward"
    Settings = FeedForwardSettings

    def __init__(self, binary: int, numeric: int, active: int, out: int, hidden: Sequence[int] = (512, 512, 512),
                 activation: str = "tanh", dropout: float = 0.0, input_dropout: float = 0.0) -> None:
        super().__init__()
        hidden = FeedForwardSettings(tuple(hidden), activation, dropout, input_dropout).hidden
        self.out = out
        self.first = CodeLinear(binary, numeric, hidden[0], input_dropout)
        self.first.reset(active)
        layers: list[nn.Module] = [ACTIVATIONS[activation](), Dropout(dropout)]
        for before, after in pairwise(hidden):
            layers += [self._linear(before, after), ACTIVATIONS[activation](), Dropout(dropout)]
        self.rest = nn.Sequential(*layers, self._linear(hidden[-1], out))

    @staticmethod
    def _linear(before: int, after: int) -> nn.Linear:
        layer = Linear(before, after)
        nn.init.xavier_uniform_(layer.weight)
        nn.init.zeros_(layer.bias)
        return layer

    def forward(self, active: Tensor, numeric: Tensor, lengths: Any = None) -> Tensor:
        """Return the normalised streams (B, out) of a batch of frames."""
        del lengths
        return self.rest(self.first(active, numeric))
