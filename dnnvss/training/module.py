"""The Lightning module: loss, optimiser, schedule, and what is logged."""

import copy
import math
from collections.abc import Sequence
from typing import Any

import lightning as L
import torch
from torch import Tensor, nn

from dnnvss.errors import DnnvssError
from dnnvss.training.allocator import keep_freed_memory
from dnnvss.training.batches import Batch
from dnnvss.training.graph import GraphedStep
from dnnvss.training.settings import LOG_VARIANCE, FitSettings


class FrameRegression(L.LightningModule):
    """Weighted error between predicted and measured streams, both normalised.

    A training step of Lightning is a block of batches here, each with a step of its own (``global_step`` counts these):
    what Lightning does around a step takes longer than a step of a small network. On one GPU the step is recorded and
    replayed.

    The loss of a batch is the mean over frames of the sum (or mean) over outputs; ``val/static`` is the mean squared
    error of the static stream alone, by which the fit stops early: most of delta-delta cannot be predicted and would
    rule an unweighted criterion.

    A network with as many outputs again tells log variances in the second half. Its loss is the Gaussian negative
    log likelihood ``((y - m)^2 / v + log v) / 2``, each output weighted by the square root of its own v (as a
    constant): without the weight, frames that are thought to be uncertain are no longer learnt.

    **Source**: Nix and Weigend, Estimating the mean and variance of the target probability distribution (1994); Seitzer
    et al., On the pitfalls of heteroscedastic uncertainty estimation with probabilistic neural networks (2022),
    equation 5, beta 0.5.

    Args:
        network: active columns and numeric inputs to outputs.
        settings: of the fit.
        streams, dimensions: W and D of the targets.
        steps: of the whole fit, for the schedule of the learning rate.
    """

    def __init__(self, network: nn.Module, settings: FitSettings, streams: int, dimensions: int,
                 steps: int = 1) -> None:
        super().__init__()
        self.automatic_optimization, self.steps = False, steps
        self.network, self.settings, self.members = network, settings, int(getattr(network, "members", 1))
        self.streams, self.dimensions = streams, dimensions
        weights = torch.tensor(settings.stream_weights[:streams], dtype=torch.float32)
        if len(weights) != streams:
            raise DnnvssError(f"{len(weights)} stream weights for {streams} streams",
                              remedy="Give trainer.stream_weights one value a stream")
        self.register_buffer("output_weights", weights.repeat_interleave(dimensions), persistent=False)
        self.trained = torch.compile(network.forward) if settings.compile else network.forward
        self.average = copy.deepcopy(network).requires_grad_(False) if settings.average else None

    @property
    def optimizer(self) -> torch.optim.Optimizer:
        """The optimiser itself, without Lightning's count of its steps: a replay would not call it."""
        return self.optimizers(use_pl_optimizer=False)  # type: ignore[return-value]

    @property
    def result(self) -> nn.Module:
        """The network that the fit is for: that of the last step, or the average over steps."""
        return self.network if self.average is None else self.average

    def forward(self, active: Tensor, numeric: Tensor) -> Tensor:
        """Return the normalised streams (B, W x D), and their log variances behind them where there are any."""
        return self.trained(active, numeric) if self.training else self.result(active, numeric)

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
        """Keep freed memory for the next step; record the step where one GPU does all of it."""
        keep_freed_memory()
        self.taken, self.lost, self.mean = (torch.zeros((), device=self.device) for _ in range(3))
        self.take = self.step
        if self.device.type == "cuda" and self.trainer.world_size == 1 and self.settings.graph:
            self.take = GraphedStep(self.step, self.optimizer)  # type: ignore[assignment]

    def on_train_epoch_start(self) -> None:
        """Count the steps of the epoch anew."""
        for count in (self.taken, self.lost, self.mean):
            count.zero_()

    def training_step(self, block: Sequence[Batch], index: int) -> None:
        """Take a step with each batch; a loss that is not finite ends the fit with the settings that caused it."""
        schedule = self.lr_schedulers()
        counted = self.trainer.fit_loop.epoch_loop.manual_optimization.optim_step_progress  # which is ``global_step``
        for batch in block:
            self._seed()
            self.take(batch)
            if self.average is not None:
                self._follow(self.average)
            schedule.step()  # type: ignore[union-attr]
            counted.increment_ready()
            counted.increment_completed()
        if lost := int(self.trainer.strategy.reduce(self.lost.clone(), reduce_op="max")):
            raise self.settings.diverged(f"the loss of batch {lost - 1} in epoch {self.current_epoch}", float("nan"))

    def step(self, batch: Batch) -> None:
        """Change the weights by one batch. Nothing here waits for the device, so that a step can be recorded."""
        torch.clear_autocast_cache()  # which holds the weights of the step before, rounded
        loss = self.loss(self(batch[0], batch[1]), batch[2])
        with torch.autocast(self.device.type, enabled=False):
            self.manual_backward(loss * self.members)  # of which each member has its own part
            self.clip()
            self.optimizer.step()
            self.optimizer.zero_grad()
        self.taken += 1
        self.mean += (loss.detach() - self.mean) / self.taken
        self.lost += (~torch.isfinite(loss) & (self.lost == 0)) * self.taken

    def _seed(self) -> None:
        """Seed dropout by the step, so that a resumed run draws the same masks; loaders share the generator.

        Processes that share the fit draw masks of their own.
        """
        seed = self.settings.seed * 1_000_003 + self.global_step + 7_919_000_017 * self.global_rank
        if self.device.type == "cuda":
            torch.cuda.default_generators[self.device.index].manual_seed(seed)
        else:  # torch.manual_seed sees to all devices, and takes as long as a step of a small network
            torch.default_generator.manual_seed(seed)

    @torch.no_grad()
    def _follow(self, average: nn.Module) -> None:
        """Move the average towards the present weights, all the way after the first step."""
        share = 1 - self.settings.average if self.global_step else 1.0
        torch._foreach_lerp_(list(average.parameters()), list(self.network.parameters()), share)

    def on_train_epoch_end(self) -> None:
        """Log the mean loss of the epoch's steps."""
        self.log("train/loss", self.mean, sync_dist=True)

    def validation_step(self, batch: Batch, index: int) -> None:
        """Log the loss and the static error."""
        predicted = self(batch[0], batch[1])
        static = (predicted[:, : self.dimensions] - batch[2][:, : self.dimensions]).square().mean()
        self.log("val/loss", self.loss(predicted, batch[2]), batch_size=len(batch[0]), sync_dist=True)
        self.log("val/static", static, batch_size=len(batch[0]), prog_bar=True, sync_dist=True)

    def clip(self) -> None:
        """Scale gradients whose norm is too large; on the processor others are not touched, which saves a pass."""
        grads = [p.grad for p in self.parameters() if p.grad is not None]
        if self.members > 1:
            norms = torch.stack([torch.linalg.vector_norm(g.flatten(1), dim=1) for g in grads])
            shrink = (self.settings.clip / (torch.linalg.vector_norm(norms, dim=0) + 1e-6)).clamp(max=1)
            for grad in grads:
                grad.mul_(shrink.view(-1, *[1] * (grad.ndim - 1)))
            return
        if self.device.type != "cpu":
            shrink = self.settings.clip / (nn.utils.get_total_norm(grads) + 1e-6)
            torch._foreach_mul_(grads, shrink.clamp(max=1))
            return
        flat = [g.flatten() for g in grads]  # a product with itself takes half as long as torch's norm
        shrink = self.settings.clip / (torch.stack([g.dot(g) for g in flat]).sum().sqrt() + 1e-6)
        if shrink < 1:
            torch._foreach_mul_(grads, shrink)

    def configure_optimizers(self) -> Any:
        """Return the optimiser and a schedule that steps with every batch."""
        s = self.settings
        if s.optimizer == "sgd":
            optimizer: torch.optim.Optimizer = torch.optim.SGD(
                self.network.parameters(), s.learning_rate, s.momentum, weight_decay=s.weight_decay, fused=True)
        else:
            optimizer = torch.optim.AdamW(self.network.parameters(), s.learning_rate, weight_decay=s.weight_decay,
                                          fused=True)
        warmup = max(1, int(s.warmup * self.steps))

        def factor(step: int) -> float:
            rise = min(1.0, (step + 1) / warmup)
            if s.schedule == "constant":
                return rise
            return rise * 0.5 * (1 + math.cos(math.pi * min(1.0, step / self.steps)))

        return [optimizer], [torch.optim.lr_scheduler.LambdaLR(optimizer, factor)]
