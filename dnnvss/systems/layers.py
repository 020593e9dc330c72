"""The layers of a fitted feed-forward network in NumPy: what :class:`~dnnvss.systems.feedforward.FeedForward` says of
an utterance, without torch."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.settings import check_settings, setting

ACTIVATIONS = ("tanh", "sigmoid", "relu")
_RUN = 32
"""Frames whose sums are told as changes from the frame before: rounding has no more of them to add up in."""


@dataclass(frozen=True)
class FeedForwardSettings:
    """The size of a feed-forward network.

    Raises:
        DnnvssError: no hidden layer, or a value that is out of range.
    """

    hidden: tuple[int, ...] = setting((512, 512, 512), least=1, doc="width of each hidden layer")
    activation: str = setting("tanh", choices=ACTIVATIONS)
    dropout: float = setting(0.0, least=0, below=1, doc="share of hidden units dropped in training")
    input_dropout: float = setting(0.0, least=0, below=1, doc="share of active binary inputs dropped in training")

    def __post_init__(self) -> None:
        check_settings(self, "model.network")
        if not self.hidden:
            raise DnnvssError("model.network.hidden=[] is no network",
                              remedy="Give the width of one layer at least: model.network.hidden=[512]")

    @property
    def widest(self) -> int:
        """Inputs of the widest linear layer behind the first."""
        return max(self.hidden)


@dataclass(frozen=True)
class Layers:
    """A fitted network, frame by frame.

    Args:
        columns: rows (C + 1, H) of the binary columns; the last belongs to padding.
        numbers: (N, H), of the normalised numbers.
        bias: (H,), of the first layer.
        rest: weight (before, after) and bias of each further layer, the last of them linear.
        activation: one of :data:`ACTIVATIONS`.
    """

    columns: np.ndarray
    numbers: np.ndarray
    bias: np.ndarray
    rest: tuple[tuple[np.ndarray, np.ndarray], ...]
    activation: str

    @classmethod
    def of(cls, weights: Mapping[str, np.ndarray], settings: FeedForwardSettings, binary: int, numeric: int, out: int
           ) -> "Layers | None":
        """The layers whose weights lie in a state by the names that torch gives them; None where they do not fit.

        Args:
            weights: by name.
            settings, binary, numeric, out: what they are to fit.
        """
        sizes = (*settings.hidden, out)
        wanted: dict[str, tuple[int, ...]] = {"first.weight": (binary + 1, sizes[0]), "first.bias": (sizes[0],),
                                              "first.numeric_weight": (numeric, sizes[0])}
        for k, (before, after) in enumerate(pairwise(sizes)):
            wanted |= {f"rest.{3 * k + 2}.weight": (after, before), f"rest.{3 * k + 2}.bias": (after,)}
        given = {name: (array.shape, array.dtype) for name, array in weights.items()}
        if given != {name: (shape, np.dtype(np.float32)) for name, shape in wanted.items()}:
            return None
        rest = [(weights[f"rest.{3 * k + 2}.weight"].T, weights[f"rest.{3 * k + 2}.bias"])
                for k in range(len(sizes) - 1)]
        columns, numbers, bias = (weights[f"first.{name}"] for name in ("weight", "numeric_weight", "bias"))
        return cls(columns, numbers, bias, tuple(rest), settings.activation)

    def __call__(self, active: np.ndarray, numeric: np.ndarray) -> np.ndarray:
        """Return the outputs (T, out), float32, of neighbouring frames.

        Args:
            active: binary columns (T, A) that are 1, as :meth:`FrameCodes.active` gives them.
            numeric: normalised numbers (T, N), float32.
        """
        x = self._summed(active)
        x += numeric @ self.numbers
        x += self.bias
        for weight, bias in self.rest:
            x = self._bent(x) @ weight
            x += bias
        return x

    def _summed(self, active: np.ndarray) -> np.ndarray:
        """Return the sums (T, H) of the rows of active columns.

        From one frame to the next few columns change, so that most frames are told as what comes and goes: a sparse
        product with 1 and -1, added up along runs of :data:`_RUN` frames.
        """
        from scipy.sparse import csr_array  # loaded with what generates trajectories

        frames, slots = active.shape
        whole = (np.arange(frames) % _RUN == 0)[:, None]
        changes = np.ones(active.shape, bool)
        np.not_equal(active[1:], active[:-1], out=changes[1:])
        told = np.concatenate([changes | whole, changes & ~whole], axis=1)  # what comes, and what goes
        columns = np.concatenate([active, np.roll(active, 1, axis=0)], axis=1)[told]
        signs = np.repeat(np.array([1, -1], np.float32), slots)
        signs = np.broadcast_to(signs, told.shape)[told]
        ends = np.concatenate([[0], np.cumsum(told.sum(axis=1))])
        summed: np.ndarray = csr_array((signs, columns, ends), (frames, len(self.columns))) @ self.columns
        for k in range(1, _RUN):
            run = summed[k::_RUN]
            run += summed[k - 1 :: _RUN][: len(run)]
        return summed

    def _bent(self, x: np.ndarray) -> np.ndarray:
        """Return the activation of units, in their place."""
        return _BENT[self.activation](x)


def _sigmoid(x: np.ndarray) -> np.ndarray:
    np.multiply(x, 0.5, out=x)
    np.tanh(x, out=x)
    np.multiply(x, 0.5, out=x)
    return np.add(x, 0.5, out=x)


_BENT: dict[str, Callable[[np.ndarray], Any]] = {
    "tanh": lambda x: np.tanh(x, out=x), "sigmoid": _sigmoid, "relu": lambda x: np.maximum(x, 0, out=x)}
