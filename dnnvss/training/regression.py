"""Frame regression: the weighted error between predicted and measured streams, both normalised."""

from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor

from dnnvss.errors import DnnvssError
from dnnvss.training.objective import Measured, Network, Objective
from dnnvss.training.settings import LOG_VARIANCE, FitSettings


class FrameRegression(Objective):
    """Weighted squared error, or Gaussian likelihood where the network tells log variances.

    The loss of a batch is the mean over frames of the sum (or mean) over outputs; ``val/static`` is the mean squared
    error of the static stream alone, by which the fit stops early: most of delta-delta cannot be predicted and would
    rule an unweighted criterion. Beyond 100 times ``val/null`` it has diverged: that is what the mean of the training
    frames costs, which knows nothing; about 1, or far more where something moves that hardly moved in training.

    A network with as many outputs again tells log variances in the second half. Its loss is the Gaussian negative
    log likelihood ``((y - m)^2 / v + log v) / 2``, each output weighted by the square root of its own v (as a
    constant): without the weight, frames that are thought to be uncertain are no longer learnt.

    **Source**: Nix and Weigend, Estimating the mean and variance of the target probability distribution (1994); Seitzer
    et al., On the pitfalls of heteroscedastic uncertainty estimation with probabilistic neural networks (2022),
    equation 5, beta 0.5.

    Args:
        settings: ``stream_weights`` and ``reduction``.
        streams, dimensions: W and D of the targets.

    Raises:
        DnnvssError: fewer weights than streams.
    """

    watched, title = "val/static", "static error"
    most, null = 100.0, "val/null"

    def __init__(self, settings: FitSettings, streams: int, dimensions: int) -> None:
        super().__init__()
        self.settings, self.dimensions = settings, dimensions
        weights = torch.tensor(settings.stream_weights[:streams], dtype=torch.float32)
        if len(weights) != streams:
            raise DnnvssError(f"{len(weights)} stream weights for {streams} streams",
                              remedy="Give trainer.stream_weights one value a stream")
        self.register_buffer("output_weights", weights.repeat_interleave(dimensions), persistent=False)

    def told(self, network: Network, batch: Any) -> tuple[Tensor, Tensor]:
        """Outputs and targets of the frames of a batch that were measured."""
        return network(batch[0], batch[1]), batch[2]

    def loss(self, network: Network, batch: Any) -> Tensor | None:
        """The loss of a batch."""
        predicted, target = self.told(network, batch)
        return self.error(predicted, target) if len(target) else None

    def error(self, predicted: Tensor, target: Tensor) -> Tensor:
        """The loss of outputs (B, W x D), or twice as many, against targets (B, W x D)."""
        outputs = target.shape[1]
        error = (predicted[:, :outputs] - target).square()
        if predicted.shape[1] > outputs:
            spread = predicted[:, outputs:].clamp(*LOG_VARIANCE)
            error = 0.5 * (error * torch.exp(-spread) + spread) * torch.exp(0.5 * spread).detach()
        error = error * self.get_buffer("output_weights")
        return error.sum(1).mean() if self.settings.reduction == "sum" else error.mean()

    def measures(self, network: Network, batch: Any) -> Mapping[str, Measured]:
        """The loss and the static error."""
        predicted, target = self.told(network, batch)
        if not (count := len(target)):
            return {}
        said, true = predicted[:, : self.dimensions], target[:, : self.dimensions]
        return {"val/loss": Measured(self.error(predicted, target), count),
                "val/static": Measured((said - true).square().mean(), count),
                "val/null": Measured(true.square().mean(), count)}

    def diverged(self, where: str, value: float) -> DnnvssError:
        """The error that names the settings which may be to blame."""
        s = self.settings
        return DnnvssError(
            f"training diverged: {where} is {value:.4g} at learning rate {s.learning_rate} ({s.optimizer}, "
            f"reduction {s.reduction!r}, batch size {s.batch_size})",
            remedy="Lower trainer.learning_rate or trainer.clip; the run folder keeps the last good checkpoint")


class UtteranceRegression(FrameRegression):
    """The same for networks over time: batches hold whole utterances, of which the measured frames count."""

    def told(self, network: Network, batch: Any) -> tuple[Tensor, Tensor]:
        """Outputs and targets of the frames of a batch that were measured."""
        active, numeric, targets, valid, counts = batch
        return network(active, numeric, counts)[valid], targets[valid]
