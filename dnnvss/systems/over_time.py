"""What networks over time have in common: an embedding of frames, a core over time, outputs."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor, nn

from dnnvss.systems.feedforward import CodeLinear
from dnnvss.systems.frame_network import FrameNetwork, NetworkStream, counts
from dnnvss.training.dropout import Dropout


class Core(nn.Module, ABC):
    """From rows of utterances to rows of the same utterances; what makes one kind another."""

    @abstractmethod
    def forward(self, rows: Tensor, mask: Tensor | None = None) -> Tensor:
        """Rows (B, T, K) of rows (B, T, H).

        Args:
            rows: of B utterances, filled up to T.
            mask: (B, T) bool, False where an utterance has ended; all True where None.
        """

    @abstractmethod
    def advance(self, rows: Tensor, state: Any) -> tuple[Tensor, Any]:
        """The next rows (1, n, K) of one utterance and what to go on from; it begins with None."""


class OverTime(nn.Module):
    """Everything behind the first layer: ``tanh``, dropout, the core, and a linear output.

    With ``lookahead`` L the core sees no frame ahead, and its row t + L is that of frame t: behind
    the end of an utterance come L rows of zeros.

    Args:
        core: over time.
        width: K, of the core's rows.
        out: output values a frame.
        dropout: share of the units dropped in training before and behind the core.
        lookahead: L; None where the core sees the whole utterance.
    """

    def __init__(self, core: Core, width: int, out: int, dropout: float, lookahead: int | None) -> None:
        super().__init__()
        self.core, self.shift = core, lookahead or 0
        self.before, self.behind = Dropout(dropout), Dropout(dropout)
        self.out = nn.Linear(width, out)
        nn.init.xavier_uniform_(self.out.weight)
        nn.init.zeros_(self.out.bias)

    def forward(self, first: Tensor, lengths: Sequence[int] | None = None) -> Tensor:
        """Outputs (N, out) of what the first layer makes (N, H) of utterances of these lengths."""
        rows = self.embedded(first)
        if lengths is None or len(lengths) == 1:
            padded = nn.functional.pad(rows, (0, 0, 0, self.shift))[None]
            return self.outputs(self.core(padded)[0, self.shift :])
        parts = rows.split(list(lengths))
        padded = nn.utils.rnn.pad_sequence(list(parts), batch_first=True)
        padded = nn.functional.pad(padded, (0, 0, 0, self.shift))
        ends = torch.tensor(lengths, device=rows.device)[:, None]
        places = torch.arange(padded.shape[1], device=rows.device)
        seen = self.core(padded, places < ends + self.shift)[:, self.shift :]
        return self.outputs(seen[places[: seen.shape[1]] < ends])

    def embedded(self, first: Tensor) -> Tensor:
        """What the core sees (N, H) of each frame."""
        return self.before(torch.tanh(first))

    def outputs(self, rows: Tensor) -> Tensor:
        """Outputs (N, out) of the core's rows (N, K)."""
        return self.out(self.behind(rows))


class SequenceNetwork(FrameNetwork):
    """A network over time: a layer that sees the columns of a frame, then :class:`OverTime`.

    Args:
        first: columns to H units.
        rest: over time.
        lookahead: frames behind its own that an output depends on; None for the whole utterance.
    """

    over_time = True

    def __init__(self, first: CodeLinear, rest: OverTime, lookahead: int | None) -> None:
        super().__init__()
        self.first, self.rest, self.lookahead = first, rest, lookahead
        self.out = rest.out.out_features

    def forward(self, active: Tensor, numeric: Tensor, lengths: Any = None) -> Tensor:
        """Outputs (N, out); see :meth:`FrameNetwork.forward`."""
        return self.rest(self.first(active, numeric), counts(lengths, len(active)))

    def stream(self) -> "SequenceStream":
        """A new utterance whose frames arrive bit by bit; only for networks with a look-ahead."""
        assert self.lookahead is not None, "this network sees the whole utterance"
        return SequenceStream(self)


class SequenceStream(NetworkStream):
    """Outputs of a causal network while inputs arrive, each as late as the network looks ahead."""

    network: SequenceNetwork

    def __init__(self, network: SequenceNetwork) -> None:
        super().__init__(network)
        self.state: Any = None
        self.early = network.rest.shift  # rows of the core that belong to no frame

    def push(self, active: Tensor, numeric: Tensor) -> Tensor:
        """Outputs (n, out) of the frames that are settled once these came in."""
        rest = self.network.rest
        return self._advance(rest.embedded(self.network.first(active, numeric)))

    def finish(self) -> Tensor:
        """Outputs (n, out) of the frames that were held back."""
        bias = self.network.first.bias
        return self._advance(bias.new_zeros(self.network.rest.shift, len(bias)))

    def _advance(self, rows: Tensor) -> Tensor:
        rest = self.network.rest
        if not len(rows):
            return rows.new_zeros(0, self.network.out)
        seen, self.state = rest.core.advance(rows[None], self.state)
        left_out, self.early = self.early, max(self.early - len(rows), 0)
        return rest.outputs(seen[0, left_out:])
