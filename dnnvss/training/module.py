"""The Lightning module of every fit: steps, averages, and what is logged."""

import copy
from collections.abc import Callable, Sequence
from typing import Any

import lightning as L
import torch
from torch import Tensor, nn

from dnnvss.training.allocator import keep_freed_memory
from dnnvss.training.graph import GraphedStep
from dnnvss.training.objective import Objective
from dnnvss.training.recipe import Moment, Recipe
from dnnvss.training.settings import FitSettings

_APART = 7_919_000_017
"""Between the seeds of processes that share a fit."""


class FitModule(L.LightningModule):
    """A network, what its fit makes small, and how its weights move.

    A training step of Lightning is a block of batches here, each with a step of its own (``global_step`` counts these):
    what Lightning does around a step takes longer than a step of a small network. On one GPU the step is recorded and
    replayed.

    Args:
        network: inputs to outputs.
        objective: the loss, and what is measured on validation.
        recipe: how the weights move.
        settings: ``compile``, ``average`` and ``graph``.
        steps: of the whole fit, for the schedule of the learning rate.
    """

    def __init__(self, network: nn.Module, objective: Objective, recipe: Recipe, settings: FitSettings,
                 steps: int = 1) -> None:
        super().__init__()
        self.automatic_optimization, self.steps = False, steps
        self.network, self.settings, self.members = network, settings, int(getattr(network, "members", 1))
        self.objective, self.recipe = objective, recipe
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

    def forward(self, *inputs: Tensor) -> Tensor:
        """Outputs of the network: in training of the one that is trained, else of the result."""
        return self.trained(*inputs) if self.training else self.result(*inputs)

    def on_fit_start(self) -> None:
        """Keep freed memory for the next step; record the step where one GPU does all of it."""
        keep_freed_memory()
        self.taken, self.lost, self.mean = (torch.zeros((), device=self.device) for _ in range(3))
        self.parts = list(self.network.parameters())
        self.take: Callable[[Any], bool] = self.step
        if self.device.type == "cuda" and self.trainer.world_size == 1 and self.settings.graph:
            self.take = GraphedStep(self.step, self.optimizer)

    def on_train_epoch_start(self) -> None:
        """Count the steps of the epoch anew."""
        for count in (self.taken, self.lost, self.mean):
            count.zero_()

    def training_step(self, block: Sequence[Any], index: int) -> None:
        """Take a step with each batch; a loss that is not finite ends the fit with the settings that caused it."""
        schedule = self.lr_schedulers()
        counted = self.trainer.fit_loop.epoch_loop.manual_optimization.optim_step_progress  # which is ``global_step``
        for place, batch in enumerate(block):
            self._seed(Moment(self.current_epoch, index + place == 0, self.global_step))
            if self.take(batch):
                if self.average is not None:
                    self._follow(self.average)
                schedule.step()  # type: ignore[union-attr]
            counted.increment_ready()
            counted.increment_completed()
        if lost := int(self.trainer.strategy.reduce(self.lost.clone(), reduce_op="max")):
            raise self.objective.diverged(f"the loss of batch {lost - 1} in epoch {self.current_epoch}", float("nan"))

    def step(self, batch: Any) -> bool:
        """Change the weights by one batch, unless it says nothing, and tell whether they were.

        Nothing here waits for the device, so that a step can be recorded.
        """
        torch.clear_autocast_cache()  # which holds the weights of the step before, rounded
        loss = self.objective.loss(self, batch)
        if loss is None:
            return False
        with torch.autocast(self.device.type, enabled=False):
            self.manual_backward(loss * self.members)  # of which each member has its own part
            self.recipe.clip(self.parts)
            self.optimizer.step()
            self.optimizer.zero_grad()
        self.taken += 1
        self.mean += (loss.detach() - self.mean) / self.taken
        self.lost += (~torch.isfinite(loss) & (self.lost == 0)) * self.taken
        return True

    def _seed(self, moment: Moment) -> None:
        """Seed dropout as the recipe says; processes that share the fit draw masks of their own."""
        if (seed := self.recipe.seed(moment)) is None:
            return
        seed += _APART * self.global_rank
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

    def validation_step(self, batch: Any, index: int) -> None:
        """Log what the objective measures."""
        for name, (value, weight) in self.objective.measures(self, batch).items():
            self.log(name, value, batch_size=weight, prog_bar=name == self.objective.watched, sync_dist=True)

    def configure_optimizers(self) -> Any:
        """The optimiser, and a schedule that steps with every batch."""
        optimizer = self.recipe.optimizer(self.network)
        return [optimizer], [self.recipe.schedule(optimizer, self.steps)]
