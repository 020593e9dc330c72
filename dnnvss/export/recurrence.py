"""Recurrent layers as other programs know them: an operation of ONNX, or a loop of torch.export.

Tracing a layer of torch's would write out its steps one by one, for one number of frames.
"""

import copy

import torch
from torch import Tensor, nn

from dnnvss.systems.recurrent import RecurrentLayer

_ORDERS = {"LSTM": (0, 3, 1, 2), "GRU": (1, 0, 2)}
"""The gates as ONNX has them (input, output, forget, cell; update, reset, hidden) among torch's
(input, forget, cell, output; reset, update, hidden)."""
_OPSET = 14


def portable(module: nn.Module, onnx: bool) -> nn.Module:
    """A copy of a module whose recurrent layers can be traced for any number of frames.

    Args:
        module: any.
        onnx: whether it goes into an ONNX file; a torch.export program otherwise.
    """
    made = copy.deepcopy(module)
    for parent in list(made.modules()):
        for name, child in list(parent.named_children()):
            if isinstance(child, RecurrentLayer):
                setattr(parent, name, OnnxLayer(child) if onnx else LoopLayer(child))
    return made


class OnnxLayer(nn.Module):
    """A layer that becomes the operation LSTM or GRU of ONNX."""

    def __init__(self, layer: RecurrentLayer) -> None:
        super().__init__()
        cell = layer.cell
        self.operation, self.width, self.backward = cell.mode, cell.hidden_size, layer.backward
        order = _ORDERS[self.operation]

        def gates(name: str) -> Tensor:
            parts = getattr(cell, name).detach().chunk(len(order))
            return torch.cat([parts[k] for k in order])

        self.register_buffer("inner", gates("weight_ih_l0")[None])
        self.register_buffer("again", gates("weight_hh_l0")[None])
        self.register_buffer("bias", torch.cat([gates("bias_ih_l0"), gates("bias_hh_l0")])[None])

    def forward(self, rows: Tensor, mask: Tensor | None = None) -> Tensor:
        """Rows (1, T, width) of the rows (1, T, inputs) of one utterance."""
        assert mask is None
        given = rows.transpose(0, 1)
        made = torch.onnx.ops.symbolic(
            self.operation, (given, self.get_buffer("inner"), self.get_buffer("again"), self.get_buffer("bias")),
            attrs={"hidden_size": self.width, "direction": "reverse" if self.backward else "forward",
                   **({"linear_before_reset": 1} if self.operation == "GRU" else {})},
            dtype=rows.dtype, shape=(given.shape[0], 1, 1, self.width), version=_OPSET)
        return made[:, 0].transpose(0, 1)


class LoopLayer(nn.Module):
    """A layer written as a loop over frames, which torch.export keeps as a loop."""

    def __init__(self, layer: RecurrentLayer) -> None:
        super().__init__()
        cell = layer.cell
        self.step = {"LSTM": _lstm, "GRU": _gru}[cell.mode]
        self.width, self.backward = cell.hidden_size, layer.backward
        self.states = 2 if cell.mode == "LSTM" else 1
        for name in ("weight_ih_l0", "weight_hh_l0", "bias_ih_l0", "bias_hh_l0"):
            self.register_buffer(name, getattr(cell, name).detach().clone())

    def forward(self, rows: Tensor, mask: Tensor | None = None) -> Tensor:
        """Rows (1, T, width) of the rows (1, T, inputs) of one utterance."""
        from torch._higher_order_ops.scan import scan

        assert mask is None
        get = self.get_buffer
        given = rows[0].flip(0) if self.backward else rows[0]
        given = given @ get("weight_ih_l0").T + get("bias_ih_l0")
        weight, bias = get("weight_hh_l0").T.contiguous(), get("bias_hh_l0")

        def step(state: Tensor, row: Tensor) -> tuple[Tensor, Tensor]:
            after = self.step(state, row, state[0] @ weight + bias)
            return after, after[0].clone()

        _, made = scan(step, torch.zeros(self.states, self.width), given)
        return (made.flip(0) if self.backward else made)[None]


def _lstm(state: Tensor, given: Tensor, again: Tensor) -> Tensor:
    """Hidden state and cell (2, H) after a step, of what the input and the hidden state (4 H,) give."""
    keep, forget, cell, out = (given + again).chunk(4)
    memory = torch.sigmoid(forget) * state[1] + torch.sigmoid(keep) * torch.tanh(cell)
    return torch.stack([torch.sigmoid(out) * torch.tanh(memory), memory])


def _gru(state: Tensor, given: Tensor, again: Tensor) -> Tensor:
    """Hidden state (1, H) after a step, of what the input and the hidden state (3 H,) give."""
    (reset, update, new), (reset2, update2, new2) = given.chunk(3), again.chunk(3)
    candidate = torch.tanh(new + torch.sigmoid(reset + reset2) * new2)
    return torch.lerp(candidate, state[0], torch.sigmoid(update + update2))[None]
