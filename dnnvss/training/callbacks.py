"""What Lightning calls beside the steps of a fit: checkpoints, the end of a fit that diverged, figures, the bar."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import lightning as L
import torch
from lightning.pytorch.callbacks import Callback, ModelCheckpoint, TQDMProgressBar
from lightning.pytorch.plugins.io import TorchCheckpointIO
from torch import Tensor

from dnnvss.progress import counted
from dnnvss.training.checkpoints import save_checkpoint
from dnnvss.training.objective import Objective

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class WholeCheckpoints(TorchCheckpointIO):
    """Writes checkpoints whole or not at all."""

    def save_checkpoint(self, checkpoint: dict[str, Any], path: Any, storage_options: Any = None) -> None:
        """Write ``checkpoint`` beside ``path`` and move it there."""
        save_checkpoint(Path(path), checkpoint)


class Kept(ModelCheckpoint):
    """A checkpoint in the folder of the fit, wherever that was moved since the fit was killed."""

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Take over what was kept, under the present folder."""
        here = {str(old): str(Path(str(self.dirpath)) / Path(old).name) for old in state_dict["best_k_models"]}
        moved: dict[str, Any] = {"dirpath": self.dirpath,
                                 "best_k_models": {here[str(k)]: v for k, v in state_dict["best_k_models"].items()}}
        for name in ("best_model_path", "kth_best_model_path", "last_model_path"):
            moved[name] = str(Path(str(self.dirpath)) / Path(state_dict[name]).name) if state_dict[name] else ""
        super().load_state_dict(state_dict | moved)


class Watch(Callback):
    """What is watched, epoch by epoch; ends a fit in which it is no number or has exploded, before that is kept."""

    def __init__(self, objective: Objective) -> None:
        self.objective = objective
        self.history: list[float] = []

    def on_validation_end(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Keep the value, or raise the error of the objective."""
        value, title = float(trainer.callback_metrics[self.objective.watched]), self.objective.title
        null = float(trainer.callback_metrics.get(self.objective.null, 1.0))
        if not (math.isfinite(value) and value <= self.objective.most * max(null, 1.0)):
            raise self.objective.diverged(f"the {title} on validation after epoch {trainer.current_epoch}", value)
        self.history.append(value)

    def state_dict(self) -> dict[str, Any]:
        """The values so far."""
        return {"history": list(self.history)}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Take over the values of the epochs before."""
        self.history = list(state_dict["history"])


class Chance(Callback):
    """Keeps torch's generator in every checkpoint, so that a fit which is resumed draws what one that was not would."""

    kept: Tensor | None = None

    def on_train_batch_start(self, *given: Any) -> None:
        """Take up the generator before the first step."""
        if self.kept is not None:
            torch.set_rng_state(self.kept)
            self.kept = None

    def state_dict(self) -> dict[str, Any]:
        """The generator as it stands."""
        return {"generator": torch.get_rng_state()}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Remember the generator for the first step."""
        self.kept = state_dict["generator"]


class Figures(Callback):
    """Draws a figure into TensorBoard every few epochs."""

    def __init__(self, name: str, draw: Callable[[], "Figure"], every: int) -> None:
        self.name, self.draw, self.every = name, draw, every

    def on_validation_epoch_end(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Draw it, if it is time."""
        if trainer.is_global_zero and trainer.logger is not None and trainer.current_epoch % self.every == 0:
            experiment: Any = trainer.logger.experiment  # type: ignore[attr-defined]
            try:
                figure = self.draw()
            except Exception as error:  # of a library that draws: a fit is worth more
                print(f"no figure {self.name}: {type(error).__name__}: {error}")
                return
            experiment.add_figure(self.name, figure, trainer.current_epoch)  # which closes it


class Bar(TQDMProgressBar):
    """A progress bar without the version of the logger, which is always the same."""

    def get_metrics(self, trainer: L.Trainer, pl_module: L.LightningModule) -> dict[str, Any]:
        """What stands behind the bar."""
        return {k: v for k, v in super().get_metrics(trainer, pl_module).items() if k != "v_num"}


class Epochs(Callback):
    """Counts epochs in lines, where nobody watches a bar."""

    def on_train_start(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Begin to count, from the epoch that a fit goes on from."""
        hidden = not trainer.is_global_zero
        self.count = counted(desc="fit", total=trainer.max_epochs, initial=trainer.current_epoch, unit="epochs",
                             disable=hidden)

    def on_train_epoch_end(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Count one."""
        self.count.update(1)

    def on_train_end(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """End the count."""
        self.count.close()
