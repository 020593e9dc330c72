"""One fit with Lightning: checkpoints that resume, early stopping, TensorBoard."""

import logging
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import lightning as L
from lightning.pytorch.callbacks import Callback, EarlyStopping, ModelCheckpoint, TQDMProgressBar
from lightning.pytorch.loggers import TensorBoardLogger
from lightning.pytorch.plugins.io import TorchCheckpointIO
from torch import nn
from torch.utils.data import DataLoader

from dnnvss.errors import DnnvssError
from dnnvss.systems import Example, Prediction
from dnnvss.training.batches import Blocks, FrameBatches
from dnnvss.training.checkpoints import load_checkpoint, save_checkpoint
from dnnvss.training.devices import process_number
from dnnvss.training.module import FrameRegression
from dnnvss.training.precision import resolve
from dnnvss.training.settings import FitSettings

_LIGHTNING_CHATTER = (
    ".*does not have many workers.*", ".*IterableDataset.*__len__.*", ".*exists and is not empty.*",
    ".*isinstance.treespec, LeafSpec.*", ".*GPU available but not used.*",
)


class WholeCheckpoints(TorchCheckpointIO):
    """Writes checkpoints whole or not at all."""

    def save_checkpoint(self, checkpoint: dict[str, Any], path: Any, storage_options: Any = None) -> None:
        """Write ``checkpoint`` beside ``path`` and move it there."""
        save_checkpoint(Path(path), checkpoint)


class Kept(ModelCheckpoint):
    """A checkpoint in the run folder, wherever that was moved since the fit was killed."""

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Take over what was kept, under the present folder."""
        here = {str(old): str(Path(str(self.dirpath)) / Path(old).name) for old in state_dict["best_k_models"]}
        moved: dict[str, Any] = {"dirpath": self.dirpath,
                                 "best_k_models": {here[str(k)]: v for k, v in state_dict["best_k_models"].items()}}
        for name in ("best_model_path", "kth_best_model_path", "last_model_path"):
            moved[name] = str(Path(str(self.dirpath)) / Path(state_dict[name]).name) if state_dict[name] else ""
        super().load_state_dict(state_dict | moved)


EXPLODED = 100.0
"""Static error on the validation frames, in variances of the training frames, beyond which a fit has diverged: the mean
of the training frames, which knows nothing, has about 1."""


class Watch(Callback):
    """Ends a fit whose validation error is no number or has exploded, before the epoch is kept as a checkpoint."""

    def __init__(self, settings: FitSettings) -> None:
        self.settings = settings

    def on_validation_end(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Raise the error that names the learning rate, the reduction and the epoch."""
        value = float(trainer.callback_metrics["val/static"])
        if not value < EXPLODED:
            raise self.settings.diverged(f"the static error on validation after epoch {trainer.current_epoch}", value)


class TrajectoryFigure(Callback):
    """Draws measured and predicted static coefficients of one validation utterance into TensorBoard."""

    def __init__(self, example: Example, predict: Callable[[Example], Prediction], every: int) -> None:
        self.example, self.predict, self.every = example, predict, every

    def on_validation_epoch_end(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Draw the figure every few epochs."""
        if not trainer.is_global_zero or trainer.logger is None or trainer.current_epoch % self.every:
            return
        import matplotlib

        matplotlib.use("Agg")
        from matplotlib import pyplot as plt

        assert self.example.targets is not None
        predicted = self.predict(self.example).mean[:, 0]
        rows = min(5, predicted.shape[1])
        figure, axes = plt.subplots(rows, 1, figsize=(9, 1.6 * rows), sharex=True, squeeze=False)
        for d, axis in enumerate(axes[:, 0]):
            axis.plot(self.example.targets[:, 0, d], "k", lw=1, label="measured")
            axis.plot(predicted[:, d], "C0", lw=1, label="predicted")
            axis.set_ylabel(f"coefficient {d + 1}", fontsize=7)
        axes[0, 0].legend(fontsize=7, ncols=2)
        axes[-1, 0].set_xlabel(f"frame of utterance {self.example.id}")
        trainer.logger.experiment.add_figure("trajectory", figure, trainer.current_epoch)  # type: ignore[attr-defined]
        plt.close(figure)


class Bar(TQDMProgressBar):
    """A progress bar without the version of the logger, which is always the same."""

    def get_metrics(self, trainer: L.Trainer, pl_module: L.LightningModule) -> dict[str, Any]:
        """Return what stands behind the bar."""
        return {k: v for k, v in super().get_metrics(trainer, pl_module).items() if k != "v_num"}


def run_fit(network: nn.Module, train: FrameBatches, val: FrameBatches, settings: FitSettings, *, streams: int,
            dimensions: int, folder: Path, preview: tuple[Example, Callable[[Example], Prediction]]) -> None:
    """Fit ``network`` in place and leave it with the weights of the best epoch.

    Raises:
        DnnvssError: the loss diverged, or the checkpoint to resume from is damaged.
    """
    logging.getLogger("lightning.pytorch").setLevel(logging.WARNING)
    epochs, smoke = (1, 1) if settings.smoke else (settings.epochs, None)
    module = FrameRegression(network, settings, streams, dimensions, smoke or epochs * len(train))
    checkpoints = folder / "checkpoints"
    best = Kept(checkpoints, "best", monitor="val/static", enable_version_counter=False, save_on_train_epoch_end=True)
    last = Kept(checkpoints, "last", every_n_epochs=1, enable_version_counter=False, save_on_train_epoch_end=True)
    stop = EarlyStopping("val/static", patience=settings.patience)
    callbacks: list[Callback] = [Watch(settings), best, last, stop]
    if settings.progress:
        callbacks.append(Bar())
    if settings.figure_every:
        callbacks.append(TrajectoryFigure(*preview, settings.figure_every))
    trainer = L.Trainer(
        plugins=[WholeCheckpoints()], default_root_dir=folder, callbacks=callbacks,
        max_epochs=epochs,
        logger=TensorBoardLogger(folder, name="", version="tensorboard"),
        precision=resolve(settings.precision, settings.accelerator),  # type: ignore[arg-type]
        accelerator=settings.accelerator, devices=settings.devices, num_nodes=settings.nodes,
        strategy=settings.strategy, use_distributed_sampler=False, enable_progress_bar=settings.progress,
        enable_model_summary=False, num_sanity_val_steps=0, limit_train_batches=smoke, log_every_n_steps=1,
    )
    if settings.batch_size % trainer.world_size:
        raise DnnvssError(f"a batch of {settings.batch_size} frames cannot be shared by {trainer.world_size} processes",
                          remedy="Choose trainer.batch_size as a multiple of trainer.devices times trainer.nodes")
    train.epoch = lambda: trainer.current_epoch
    train.place = val.place = lambda: (trainer.global_rank, trainer.world_size)
    if trainer.strategy.root_device.type == "cuda":
        train.to(trainer.strategy.root_device), val.to(trainer.strategy.root_device)
    start, ended = resume_point(checkpoints, stop)
    with warnings.catch_warnings():
        for message in _LIGHTNING_CHATTER:
            warnings.filterwarnings("ignore", message=message)
        try:
            if not ended:
                trainer.fit(module, DataLoader(Blocks(train, smoke or 0), batch_size=None),
                            DataLoader(val, batch_size=None), ckpt_path=start, weights_only=True)
        except SystemExit as end:  # Lightning turns Ctrl-C into an exit of its own
            raise KeyboardInterrupt from end
    module.load_state_dict(load_checkpoint(checkpoints / "best.ckpt")["state_dict"])
    network.load_state_dict(module.result.state_dict())


def _stopped(checkpoint: dict[str, Any], stop: EarlyStopping) -> bool:
    """Return whether the fit had been stopped early when it left the checkpoint."""
    return checkpoint.get("callbacks", {}).get(stop.state_key, {}).get("wait_count", 0) >= max(stop.patience, 1)


def resume_point(checkpoints: Path, stop: EarlyStopping) -> tuple[Path | None, bool]:
    """Return the checkpoint from which a fit goes on, and whether it had been stopped early there.

    The last one, or an earlier one where the last is damaged; None where the fit begins.

    A fit depends on its seed and its epoch alone, so that it ends with the same weights from either.

    Raises:
        DnnvssError: there is a checkpoint and none is whole.
    """
    if process_number() == 0:
        for part in checkpoints.glob(".*.part*"):  # what a killed fit was writing
            part.unlink(missing_ok=True)
    found = [path for name in ("last.ckpt", "best.ckpt") if (path := checkpoints / name).exists()]
    problem: DnnvssError | None = None
    for path in found:
        try:
            kept = load_checkpoint(path)
        except DnnvssError as error:
            problem = problem or error
            continue
        if problem is not None:
            print(f"{problem.file} is damaged: the fit goes on from {path.name} (epoch {kept.get('epoch')})")
        else:
            print(f"{path}: epoch {kept.get('epoch')} was the last")
        return path, _stopped(kept, stop)
    if problem is not None:
        raise problem
    return None, False
