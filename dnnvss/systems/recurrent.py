"""Recurrent networks: LSTM or GRU over whole utterances, both ways or with a bounded look-ahead."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn

from dnnvss.settings import check_settings, setting
from dnnvss.systems.feedforward import CodeLinear
from dnnvss.systems.over_time import Core, OverTime, SequenceNetwork
from dnnvss.training.dropout import Dropout

CELLS: dict[str, Callable[..., nn.RNNBase]] = {"lstm": nn.LSTM, "gru": nn.GRU}
SETTLED = 1000
"""Frames after which a recurrent network remembers nothing that shows in its outputs."""


@dataclass(frozen=True)
class RecurrentSettings:
    """The size of a recurrent network.

    Raises:
        DnnvssError: a value that is out of range.
    """

    cell: str = setting("lstm", choices=CELLS)
    layers: int = setting(2, least=1, most=16)
    width: int = setting(192, least=1, doc="units of a layer, and of each direction where both are seen")
    lookahead: int | None = setting(None, least=0, most=1000,
                                    doc="frames that an output waits for; null sees the utterance both ways")
    dropout: float = setting(0.0, least=0, below=1, doc="share of hidden units dropped in training")
    input_dropout: float = setting(0.0, least=0, below=1, doc="share of active binary inputs dropped in training")

    def __post_init__(self) -> None:
        check_settings(self, "model.network")

    @property
    def widest(self) -> int:
        """Inputs of the widest linear layer behind the first, the output: units of both directions where both are
        seen."""
        return self.width * (2 if self.lookahead is None else 1)


class RecurrentLayer(nn.Module):
    """One layer in one direction.

    Args:
        cell: a name of :data:`CELLS`.
        inputs, width: units of its rows.
        backward: whether it begins at the end of each utterance.
    """

    def __init__(self, cell: str, inputs: int, width: int, backward: bool = False) -> None:
        super().__init__()
        self.cell, self.backward = CELLS[cell](inputs, width, batch_first=True), backward

    def forward(self, rows: Tensor, mask: Tensor | None = None) -> Tensor:
        """Rows (B, T, width) of rows (B, T, inputs); what lies behind the end of one changes nothing."""
        if not self.backward:
            return self.cell(rows)[0]
        return turned(self.cell(turned(rows, mask))[0], mask)


def turned(rows: Tensor, mask: Tensor | None) -> Tensor:
    """The rows (B, T, H) of each utterance from its end to its start, those behind the end in place."""
    if mask is None:
        return rows.flip(1)
    places = torch.arange(mask.shape[1], device=mask.device)
    order = torch.where(mask, mask.sum(1, keepdim=True) - 1 - places, places)
    return rows.gather(1, order[..., None].expand(rows.shape))


class RecurrentCore(Core):
    """Layers of one or two directions, with dropout between them.

    **Source**: Schuster and Paliwal, Bidirectional recurrent neural networks (1997); Hochreiter and
    Schmidhuber, Long short-term memory (1997); Cho et al. (2014) for the GRU.
    """

    def __init__(self, cell: str, inputs: int, width: int, layers: int, both: bool, dropout: float) -> None:
        super().__init__()
        ways = (False, True) if both else (False,)
        sizes = [inputs] + [width * len(ways)] * (layers - 1)
        self.layers = nn.ModuleList(
            nn.ModuleList(RecurrentLayer(cell, size, width, way) for way in ways) for size in sizes)
        self.between = Dropout(dropout)

    def forward(self, rows: Tensor, mask: Tensor | None = None) -> Tensor:
        """Rows of the last layer; see :meth:`Core.forward`."""
        for place, layer in enumerate(self.layers):
            rows = self.between(rows) if place else rows
            parts = [one(rows, mask) for one in layer]  # type: ignore[attr-defined]
            rows = torch.cat(parts, dim=2) if len(parts) > 1 else parts[0]
        return rows

    def advance(self, rows: Tensor, state: Any) -> tuple[Tensor, Any]:
        """The next rows, of one direction; the state is that of every layer."""
        kept = []
        for layer, own in zip(self.layers, state or [None] * len(self.layers), strict=True):
            rows, after = layer[0].cell(rows, own)  # type: ignore[index]
            kept.append(after)
        return rows, kept


class Recurrent(SequenceNetwork):
    """A recurrent network from the columns of frames to their outputs.

    Args:
        binary, numeric, active: input columns, as for :class:`FeedForward`.
        out: output values a frame, W x D.
        cell, layers, width, lookahead, dropout, input_dropout: see :class:`RecurrentSettings`.
    """

    kind = "recurrent"
    Settings = RecurrentSettings

    def __init__(self, binary: int, numeric: int, active: int, out: int, cell: str = "lstm", layers: int = 2,
                 width: int = 192, lookahead: int | None = None, dropout: float = 0.0,
                 input_dropout: float = 0.0) -> None:
        settings = RecurrentSettings(cell, layers, width, lookahead, dropout, input_dropout)
        first = CodeLinear(binary, numeric, width, input_dropout)
        first.reset(active)
        core = RecurrentCore(cell, width, width, layers, lookahead is None, dropout)
        super().__init__(first, OverTime(core, settings.widest, out, dropout, lookahead), lookahead)

    @property
    def reach(self) -> tuple[int, int]:
        """Frames before and after its own beyond which an output hardly depends on the inputs."""
        return SETTLED, SETTLED if self.lookahead is None else self.lookahead
