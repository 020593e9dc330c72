"""Training on what is shown: the error of the generated trajectory, with parameter generation inside the loss."""

from collections.abc import Callable, Mapping

import torch
from torch import Tensor, nn

from dnnvss.errors import DnnvssError
from dnnvss.training.objective import Measured, Network, Objective
from dnnvss.training.utterances import Utterances

Decode = Callable[[Tensor], tuple[Tensor, Tensor]]
"""From outputs (frames, outputs) to means and variances (frames, W, D) in parameter units."""
Join = Callable[..., Tensor]
"""``join(mean (B, T, W, D), variance, lengths=(B,)) -> trajectory (B, T, D)``, differentiable."""


class TrajectoryError(Objective):
    """Mean squared error between generated and measured trajectory over measured frames.

    Each coefficient is divided by its deviation.

    **Source**: Wu and Wang, Minimum generation error training for HMM-based speech synthesis (2006).

    Args:
        decode: what the network's outputs mean.
        join: parameter generation.
        scale: deviations (D,).
    """

    watched, title = "val/trajectory", "trajectory error"

    def __init__(self, decode: Decode, join: Join, scale: Tensor) -> None:
        super().__init__()
        self.decode, self.join, self.scale = decode, join, scale

    def errors(self, network: Network, batch: Utterances) -> Tensor:
        """The squared errors (N, D) of all measured frames."""
        active, numeric, targets, valid, counts = batch
        lengths, static = counts.tolist(), targets[:, : len(self.scale)]
        mean, variance = (nn.utils.rnn.pad_sequence(list(part.split(lengths)), batch_first=True, padding_value=1.0)
                          for part in self.decode(network(active, numeric, counts)))
        joined = self.join(mean, variance, lengths=counts)
        generated = torch.cat([joined[b, :count] for b, count in enumerate(lengths)])
        return ((generated - static) / self.scale)[valid].square()

    def loss(self, network: Network, batch: Utterances) -> Tensor | None:
        """The loss of some utterances, None where no frame of theirs was measured."""
        found = self.errors(network, batch)
        return found.mean() if len(found) else None

    def measures(self, network: Network, batch: Utterances) -> Mapping[str, Measured]:
        """The error; every measured value counts alike."""
        found = self.errors(network, batch)
        return {"val/trajectory": Measured(found.mean(), found.numel())} if len(found) else {}

    def diverged(self, where: str, value: float) -> DnnvssError:
        """The error that names the rate of these passes."""
        return DnnvssError(f"training on trajectories diverged: {where} is {value:.4g}",
                           remedy="Lower trainer.refine_rate")
