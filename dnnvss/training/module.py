"""The Lightning module: loss, optimiser, schedule, and what is logged."""

import math
from typing import Any

import lightning as L
import torch
from torch import Tensor, nn

from dnnvss.errors import DnnvssError
from dnnvss.training.allocator import keep_freed_memory
from dnnvss.training.batches import Batch
from dnnvss.training.settings import LOG_VARIANCE, FitSettings


class FrameRegression(L.LightningModule):
    """Weighted error between predicted and measured streams, both normalised.

    The loss of a batch is the mean over frames of the sum (or mean) over outputs; ``val/static`` is the mean squared
    error of the static stream alone, by which the fit stops early: most of delta-delta cannot be predicted and would
    rule an unweighted criterion.

    A network with as many outputs again tells log variances in the second half. Its loss is the Gaussian negative
    log likelihood ``((y - m)^2 / v + log v) / 2``, each output weighted by the square root of its own v (as a
    constant): without the weight, frames that are thought to be uncertain are no longer learnt.

    **Source**: Nix and Weigend, Estimating the mean and variance of the target probability distribution (1994); Seitzer
    et al., On the pitfalls of heteroscedastic uncertainty estimation with probabilistic neural networks (2022),
    equation 5, beta 0.5.
    """

    def __init__(self, network: nn.Module, settings: FitSettings, streams: int, dimensions: int) -> None:
        super().__init__()
        self.network, self.settings = network, settings
        self.streams, self.dimensions = streams, dimensions
        weights = torch.tensor(settings.stream_weights[:streams], dtype=torch.float32)
        if len(weights) != streams:
            raise DnnvssError(f"{len(weights)} stream weights for {streams} streams",
                              remedy="Give trainer.stream_weights one value a stream")
        self.register_buffer("output_weights", weights.repeat_interleave(dimensions), persistent=False)

    def forward(self, active: Tensor, numeric: Tensor) -> Tensor:
        """Return the normalised streams (B, W x D), and their log variances behind them where there are any."""
        return self.network(active, numeric)

    def loss(self, predicted: Tensor, target: Tensor) -> Tensor:
        """Return the loss of a batch."""
        outputs = target.shape[1]
        error = (predicted[:, :outputs] - target).square()
        if predicted.shape[1] > outputs:
            spread = predicted[:, outputs:].clamp(*LOG_VARIANCE)
            error = 0.5 * (error * torch.exp(-spread) + spread) * torch.exp(0.5 * spread).detach()
        error = error * self.get_buffer("output_weights")
        return error.sum(1).mean() if self.settings.reduction == "sum" else error.mean()

    def on_fit_start(self) -> None:
        """Keep freed memory for the next step."""
        keep_freed_memory()

    def on_train_batch_start(self, batch: Batch, index: int) -> None:
        """Seed dropout by the step, so that a resumed run draws the same masks; loaders share the generator.

        Processes that share the fit draw masks of their own.
        """
        torch.manual_seed(self.settings.seed * 1_000_003 + self.global_step + 7_919_000_017 * self.global_rank)

    def training_step(self, batch: Batch, index: int) -> Tensor:
        """Return the loss; one that is not finite ends the fit with the settings that caused it."""
        loss = self.loss(self(batch[0], batch[1]), batch[2])
        if not torch.isfinite(loss):
            raise self.settings.diverged(f"the loss of batch {index} in epoch {self.current_epoch}", loss.item())
        self.log("train/loss", loss, on_step=False, on_epoch=True, batch_size=len(batch[0]), sync_dist=True)
        return loss

    def validation_step(self, batch: Batch, index: int) -> None:
        """Log the loss and the static error."""
        predicted = self(batch[0], batch[1])
        static = (predicted[:, : self.dimensions] - batch[2][:, : self.dimensions]).square().mean()
        self.log("val/loss", self.loss(predicted, batch[2]), batch_size=len(batch[0]), sync_dist=True)
        self.log("val/static", static, batch_size=len(batch[0]), prog_bar=True, sync_dist=True)

    def configure_gradient_clipping(self, optimizer: torch.optim.Optimizer, gradient_clip_val: float | None = None,
                                    gradient_clip_algorithm: str | None = None) -> None:
        """Scale gradients whose norm is too large; others are not touched, which saves a pass over all of them."""
        grads = [p.grad for p in self.parameters() if p.grad is not None]
        shrink = self.settings.clip / (nn.utils.get_total_norm(grads) + 1e-6)
        if shrink < 1:
            torch._foreach_mul_(grads, shrink)

    def configure_optimizers(self) -> Any:
        """Return the optimiser and a schedule that steps with every batch."""
        s = self.settings
        if s.optimizer == "sgd":
            optimizer: torch.optim.Optimizer = torch.optim.SGD(
                self.parameters(), lr=s.learning_rate, momentum=s.momentum, weight_decay=s.weight_decay, fused=True)
        else:
            optimizer = torch.optim.AdamW(self.parameters(), s.learning_rate, weight_decay=s.weight_decay, fused=True)
        total = max(1, int(self.trainer.estimated_stepping_batches))
        warmup = max(1, int(s.warmup * total))

        def factor(step: int) -> float:
            rise = min(1.0, (step + 1) / warmup)
            if s.schedule == "constant":
                return rise
            return rise * 0.5 * (1 + math.cos(math.pi * min(1.0, step / total)))

        schedule = torch.optim.lr_scheduler.LambdaLR(optimizer, factor)
        return {"optimizer": optimizer, "lr_scheduler": {"scheduler": schedule, "interval": "step"}}
