"""A trained system as one module of plain tensor operations: codes of frames in, means and variances out."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from dnnvss.errors import DnnvssError
from dnnvss.features import FeatureTable
from dnnvss.systems import VisualModel
from dnnvss.systems.blend import BlendedNetworks
from dnnvss.systems.frame_network import FrameNetwork
from dnnvss.systems.network import NetworkModel
from dnnvss.training.settings import LOG_VARIANCE


@dataclass(frozen=True)
class Share:
    """One network of a system, and its part in the mean; the parts of all add up to 1."""

    network: FrameNetwork
    table: FeatureTable
    weight: float


class FrameStreams(nn.Module):
    """Mean and variance (T, W, D) of each frame, in parameter units, from its codes.

    What :meth:`dnnvss.systems.VisualModel.predict` does, in one graph: numeric inputs are normalised, the networks run,
    their outputs are scaled and averaged, and their variances are those of the mixture. The first layer is written as
    a gather and a sum, which every runtime knows. Networks over time take the frames for one whole utterance.

    Args:
        table: the columns of the inputs.
        shares: the networks. One that reads fewer columns gets rows of zeros for the others.
        scaler: mean and deviation (N,) of the numeric columns.
        streams: ``mean``, ``deviation`` and ``variance`` (W, D) of the targets; the variance is that of the errors, or
            with ``predicted`` what the networks' own variances are multiplied by.
        predicted: whether the networks tell log variances behind the means.
    """

    def __init__(self, table: FeatureTable, shares: Sequence[Share], scaler: tuple[np.ndarray, np.ndarray],
                 streams: dict[str, np.ndarray], predicted: bool) -> None:
        super().__init__()
        self.shape, self.predicted = streams["mean"].shape, predicted
        self.reach = tuple(max(sides) for sides in zip(*(s.network.reach for s in shares), strict=True))
        self.weights = [s.weight for s in shares]
        self.layers = nn.ModuleList(s.network.get_submodule("rest") for s in shares)
        first = [_widened(s, table) for s in shares]
        for name, part in (("columns", 0), ("numbers", 1), ("bias", 2)):
            self.register_buffer(name, torch.stack([f[part] for f in first]))
        scale = np.square(streams["deviation"].astype(np.float64)) if predicted else 1.0
        constants = {"numeric_mean": scaler[0], "numeric_deviation": scaler[1], "target_mean": streams["mean"],
                     "target_deviation": streams["deviation"], "target_variance": streams["variance"] * scale}
        for name, array in constants.items():
            self.register_buffer(name, torch.tensor(np.asarray(array), dtype=torch.float32))

    def forward(self, active: Tensor, numeric: Tensor) -> tuple[Tensor, Tensor]:
        """Return means and variances (T, W, D) for active columns (T, A) int64 and numbers (T, N), not normalised."""
        get, size = self.get_buffer, self.shape[0] * self.shape[1]
        numeric = (numeric - get("numeric_mean")) / get("numeric_deviation")
        means, spreads = [], []
        for k, rest in enumerate(self.layers):
            summed = get("columns")[k][active].sum(1) + get("bias")[k]
            out = rest(summed + numeric @ get("numbers")[k])
            means.append(out[:, :size].unflatten(1, self.shape) * get("target_deviation") + get("target_mean"))
            if self.predicted:
                spread = out[:, size:].unflatten(1, self.shape).clamp(*LOG_VARIANCE)
                spreads.append(spread.exp() * get("target_variance"))
        mean = sum(w * m for w, m in zip(self.weights, means, strict=True))
        assert isinstance(mean, Tensor)
        if not self.predicted:
            return mean, get("target_variance") + torch.zeros_like(mean)
        own = sum(w * (s + (m - mean) ** 2) for w, s, m in zip(self.weights, spreads, means, strict=True))
        assert isinstance(own, Tensor)
        return mean, own


def _widened(share: Share, table: FeatureTable) -> tuple[Tensor, Tensor, Tensor]:
    """Return the first layer's rows for the columns of ``table``, the last of them padding, its numbers and bias."""
    first: Any = share.network.get_submodule("first")
    binary = torch.zeros(table.binary_width + 1, first.weight.shape[1])
    numeric = torch.zeros(table.numeric_width, first.weight.shape[1])
    for name, own in share.table.binary_slices.items():
        binary[table.binary_slices[name]] = first.weight.detach()[own]
    for name, own in share.table.numeric_slices.items():
        numeric[table.numeric_slices[name]] = first.numeric_weight.detach()[own]
    return binary, numeric, first.bias.detach().clone()


def is_network(model: VisualModel) -> bool:
    """Whether a trained system is made of networks alone that other programs can run."""
    parts = (model.phones, model.all) if isinstance(model, BlendedNetworks) else (model,)
    return all(isinstance(part, NetworkModel) and all(map(_is_known, part.networks_)) for part in parts)


def _is_known(network: FrameNetwork) -> bool:
    """Whether a network is a layer that sees the columns and plain modules behind it."""
    return all(hasattr(network, part) for part in ("first", "rest"))


def frame_streams(model: VisualModel) -> FrameStreams:
    """Return the graph of a trained system.

    Raises:
        DnnvssError: the system is not made of networks alone that other programs can run.
    """
    if isinstance(model, BlendedNetworks):
        whole, variance = model.all, model.variance_
        shares = _shares(model.phones, 1 - model.weight) + _shares(model.all, model.weight)
    elif isinstance(model, NetworkModel):
        whole, variance, shares = model, model.variance_, _shares(model, 1.0)
    else:
        raise DnnvssError(f"{type(model).__name__} is not a network, so it cannot be exported",
                          remedy="Export a run of a network: model=feedforward, recurrent, ...")
    streams = {"mean": whole.mean_, "deviation": whole.deviation_, "variance": variance}
    scaler = (whole.scaler_.mean, whole.scaler_.deviation)
    return FrameStreams(model.table, shares, scaler, streams, whole.variances).eval()


def _shares(model: NetworkModel, weight: float) -> list[Share]:
    for network in model.networks_:
        if not _is_known(network):
            raise DnnvssError(f"a network of type {type(network).__name__} cannot be exported",
                              remedy="Export a run of a kind of network that has `first` and `rest`")
    return [Share(network.cpu(), model.table, weight / len(model.networks_)) for network in model.networks_]
