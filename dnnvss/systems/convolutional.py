"""Temporal convolutions: dilated layers over whole utterances, centred or with bounded look-ahead."""

from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn

from dnnvss.errors import DnnvssError
from dnnvss.settings import check_settings, setting
from dnnvss.systems.feedforward import CodeLinear
from dnnvss.systems.over_time import Core, OverTime, SequenceNetwork
from dnnvss.training.dropout import Dropout


@dataclass(frozen=True)
class ConvolutionalSettings:
    """The size of a network of temporal convolutions.

    Raises:
        DnnvssError: a value that is out of range, or a kernel that has no centre.
    """

    width: int = setting(256, least=1, doc="units of each layer")
    kernel: int = setting(5, least=1, most=1001, doc="frames that a unit looks at")
    dilations: tuple[int, ...] = setting((1, 2, 4, 8, 1), least=1, most=1000,
                                         doc="frames between those, layer by layer")
    lookahead: int | None = setting(None, least=0, most=1000,
                                    doc="frames that an output waits for; null centres every layer")
    dropout: float = setting(0.0, least=0, below=1, doc="share of hidden units dropped in training")
    input_dropout: float = setting(0.0, least=0, below=1, doc="share of active binary inputs dropped in training")

    def __post_init__(self) -> None:
        check_settings(self, "model.network")
        if not self.dilations:
            raise DnnvssError("model.network.dilations=[] is no network",
                              remedy="Give one layer at least: model.network.dilations=[1]")
        if self.lookahead is None and self.kernel % 2 == 0:
            raise DnnvssError(f"model.network.kernel={self.kernel} has no centre",
                              remedy="Give an odd number, or a lookahead")

    @property
    def widest(self) -> int:
        """Inputs of the widest linear layer behind the first, the output."""
        return self.width


class Block(nn.Module):
    """A residual layer: ``x + dropout(gelu(conv(norm(x))))``; beyond the utterance lie zeros.

    Args:
        width: units.
        kernel, dilation: frames that are looked at, and between them.
        causal: whether no frame ahead is among them.
        dropout: share of the units dropped in training.
    """

    def __init__(self, width: int, kernel: int, dilation: int, causal: bool, dropout: float) -> None:
        super().__init__()
        self.norm, self.conv = nn.LayerNorm(width), nn.Conv1d(width, width, kernel, dilation=dilation)
        self.dropout, self.span = Dropout(dropout), (kernel - 1) * dilation
        self.ahead = 0 if causal else self.span // 2

    def forward(self, rows: Tensor, mask: Tensor | None = None) -> Tensor:
        """Rows (B, T, H) of rows (B, T, H)."""
        seen = self.norm(rows)
        if mask is not None:
            seen = seen * mask[..., None]
        return rows + self.changed(nn.functional.pad(seen.mT, (self.span - self.ahead, self.ahead)))

    def changed(self, seen: Tensor) -> Tensor:
        """What is added (B, T, H) to the rows, of columns (B, H, T + span)."""
        return self.dropout(nn.functional.gelu(self.conv(seen).mT))

    def advance(self, rows: Tensor, before: Tensor | None) -> tuple[Tensor, Tensor]:
        """The next rows (1, n, H) of a causal layer, and what it has to remember (1, H, span)."""
        seen = self.norm(rows).mT
        if before is None:
            before = seen.new_zeros(1, seen.shape[1], self.span)
        seen = torch.cat([before, seen], dim=2)
        return rows + self.changed(seen), seen[:, :, seen.shape[2] - self.span :]


class ConvolutionalCore(Core):
    """Residual layers of dilated convolutions.

    **Source**: Bai, Kolter and Koltun, An empirical evaluation of generic convolutional and
    recurrent networks for sequence modeling (2018), with one convolution a layer and its
    normalisation over the units of a frame.
    """

    def __init__(self, settings: ConvolutionalSettings) -> None:
        super().__init__()
        s, causal = settings, settings.lookahead is not None
        self.blocks = nn.ModuleList(Block(s.width, s.kernel, d, causal, s.dropout) for d in s.dilations)
        self.norm = nn.LayerNorm(s.width)

    def forward(self, rows: Tensor, mask: Tensor | None = None) -> Tensor:
        """Rows of the last layer; see :meth:`Core.forward`."""
        for block in self.blocks:
            rows = block(rows, mask)
        return self.norm(rows)

    def advance(self, rows: Tensor, state: Any) -> tuple[Tensor, Any]:
        """The next rows; the state is what every layer looks back at."""
        kept = []
        for block, before in zip(self.blocks, state or [None] * len(self.blocks), strict=True):
            rows, after = block.advance(rows, before)  # type: ignore[operator]
            kept.append(after)
        return self.norm(rows), kept


class Convolutional(SequenceNetwork):
    """A network of temporal convolutions from the columns of frames to their outputs.

    Args:
        binary, numeric, active: input columns, as for :class:`FeedForward`.
        out: output values a frame, W x D.
        width, kernel, dilations, lookahead, dropout, input_dropout: see
            :class:`ConvolutionalSettings`.
    """

    kind = "convolutional"
    Settings = ConvolutionalSettings

    def __init__(self, binary: int, numeric: int, active: int, out: int, width: int = 256, kernel: int = 5,
                 dilations: tuple[int, ...] = (1, 2, 4, 8, 1), lookahead: int | None = None, dropout: float = 0.0,
                 input_dropout: float = 0.0) -> None:
        settings = ConvolutionalSettings(width, kernel, tuple(dilations), lookahead, dropout, input_dropout)
        first = CodeLinear(binary, numeric, width, input_dropout)
        first.reset(active)
        super().__init__(first, OverTime(ConvolutionalCore(settings), width, out, dropout, lookahead), lookahead)
        self.span = sum((kernel - 1) * dilation for dilation in dilations)

    @property
    def reach(self) -> tuple[int, int]:
        """Frames before and after its own that an output depends on."""
        ahead = self.span // 2 if self.lookahead is None else self.lookahead
        return max(self.span - ahead, 0), ahead
