"""One fit with Lightning: checkpoints that resume, early stopping, TensorBoard. The loop of every network here."""

import logging
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import lightning as L
import torch
from lightning.pytorch.callbacks import Callback, EarlyStopping
from lightning.pytorch.loggers import TensorBoardLogger
from lightning.pytorch.plugins.environments import LightningEnvironment
from lightning.pytorch.utilities.exceptions import MisconfigurationException
from torch import nn
from torch.utils.data import DataLoader

from dnnvss.errors import DnnvssError
from dnnvss.training.batches import Batches, Blocks, FrameBatches
from dnnvss.training.callbacks import Bar, Chance, Epochs, Figures, Kept, Watch, WholeCheckpoints
from dnnvss.training.checkpoints import load_checkpoint
from dnnvss.training.module import FitModule
from dnnvss.training.objective import Objective
from dnnvss.training.precision import resolve
from dnnvss.training.recipe import Recipe
from dnnvss.training.resume import resume_point
from dnnvss.training.settings import FitSettings
from dnnvss.training.utterances import UtteranceBatches

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LIGHTNING_CHATTER = (
    ".*does not have many workers.*", ".*IterableDataset.*__len__.*", ".*exists and is not empty.*",
    ".*isinstance.treespec, LeafSpec.*", ".*GPU available but not used.*",
)


def run_fit(network: nn.Module, objective: Objective, recipe: Recipe, train: Batches, val: Batches,
            settings: FitSettings, folder: Path, figure: "Callable[[], Figure] | None" = None) -> list[float]:
    """Fit ``network`` in place and leave it with the weights of the best epoch.

    A fit that was killed goes on from the last whole epoch kept in ``folder/checkpoints`` and ends with the same
    weights as one that was not.

    Args:
        network: called with the inputs of a batch.
        objective: what is made small, and what tells the best epoch.
        recipe: how the weights move.
        train, val: batches; those of ``val`` are all seen after every epoch.
        settings: epochs, patience, precision, devices and what is shown.
        folder: of checkpoints and TensorBoard.
        figure: draws what TensorBoard shows every few epochs.

    Returns:
        What is watched, after each epoch.

    Raises:
        DnnvssError: the fit diverged, or the checkpoint to resume from is damaged.
    """
    logging.getLogger("lightning.pytorch").setLevel(logging.WARNING)
    epochs, smoke = (1, 1) if settings.smoke else (settings.epochs, None)
    network.train()  # which Lightning leaves as it is
    module = FitModule(network, objective, recipe, settings, smoke or epochs * len(train))
    checkpoints, watch = folder / "checkpoints", Watch(objective)
    stop = EarlyStopping(objective.watched, patience=settings.patience)
    trainer = _trainer(settings, folder, [watch, *_kept(checkpoints, objective.watched), stop, Chance(),
                                          *_shown(settings, figure)])
    train.epoch = lambda: trainer.current_epoch
    for batches in (train, val):
        if isinstance(batches, FrameBatches):
            _share(batches, trainer, settings)
    start = resume_point(checkpoints)
    watch.history = list(start.of(watch.state_key).get("history", []))
    if start.of(stop.state_key).get("wait_count", 0) < max(stop.patience, 1):  # it had not been stopped early
        with _quiet():
            try:
                trainer.fit(module, _loader(Blocks(train, smoke or 0)), _loader(val), ckpt_path=start.path,
                            weights_only=True)
            except SystemExit as end:  # Lightning turns Ctrl-C into an exit of its own
                raise KeyboardInterrupt from end
    module.load_state_dict(load_checkpoint(checkpoints / "best.ckpt")["state_dict"])
    network.load_state_dict(module.result.state_dict())
    return watch.history


def alone(settings: FitSettings) -> FitSettings:
    """The settings of a fit that one process does by itself, on the processor and without a sound."""
    return replace(settings, accelerator="cpu", devices=1, nodes=1, strategy="alone", precision="32-true", graph=False,
                   average=0.0, together=False, compile=False, progress=False, figure_every=0)


def measure(network: nn.Module, objective: Objective, val: Batches) -> float:
    """What is watched, of a network as it stands."""
    was, name = network.training, objective.watched
    network.eval()
    with torch.no_grad():
        parts = [found[name] for batch in val if name in (found := objective.measures(network, batch))]
    network.train(was)
    return sum(float(p.value) * p.weight for p in parts) / sum(p.weight for p in parts)


def _trainer(settings: FitSettings, folder: Path, callbacks: list[Callback]) -> L.Trainer:
    """Lightning's trainer.

    Raises:
        DnnvssError: there is no such accelerator here, or so many devices, or no such strategy.
    """
    try:
        return _made(settings, folder, callbacks)
    except (MisconfigurationException, TypeError, ValueError) as error:
        s, said = settings, " ".join(str(error).split())[:300]
        raise DnnvssError(f"nothing here trains with trainer.accelerator={s.accelerator} trainer.devices={s.devices} "
                          f"trainer.strategy={s.strategy} ({said})",
                          remedy="Use trainer.accelerator=auto trainer.devices=1 trainer.strategy=auto") from error


def _made(settings: FitSettings, folder: Path, callbacks: list[Callback]) -> L.Trainer:
    by_itself = settings.strategy == "alone"  # whatever cluster the process is part of
    return L.Trainer(
        plugins=[WholeCheckpoints(), *([LightningEnvironment()] if by_itself else [])], default_root_dir=folder,
        callbacks=callbacks, max_epochs=1 if settings.smoke else settings.epochs,
        logger=TensorBoardLogger(folder, name="", version="tensorboard"),
        precision=resolve(settings.precision, settings.accelerator),  # type: ignore[arg-type]
        accelerator=settings.accelerator, devices=settings.devices, num_nodes=settings.nodes,
        strategy="auto" if by_itself else settings.strategy, use_distributed_sampler=False,
        enable_progress_bar=any(isinstance(c, Bar) for c in callbacks), enable_model_summary=False,
        num_sanity_val_steps=0,
        limit_train_batches=1 if settings.smoke else None, log_every_n_steps=1,
    )


def _kept(checkpoints: Path, watched: str) -> list[Callback]:
    """The best epoch and the last."""
    return [Kept(checkpoints, "best", monitor=watched, enable_version_counter=False, save_on_train_epoch_end=True),
            Kept(checkpoints, "last", every_n_epochs=1, enable_version_counter=False, save_on_train_epoch_end=True)]


def _shown(settings: FitSettings, figure: "Callable[[], Figure] | None") -> list[Callback]:
    watched = sys.stderr is not None and sys.stderr.isatty()
    shown: list[Callback] = ([Bar()] if watched else [Epochs()]) if settings.progress else []
    if settings.figure_every and figure is not None:
        shown.append(Figures("trajectory", figure, settings.figure_every))
    return shown


def _share(batches: FrameBatches, trainer: L.Trainer, settings: FitSettings) -> None:
    """Give each process its part of every batch, on its device."""
    if not isinstance(batches, UtteranceBatches) and settings.batch_size % trainer.world_size:
        raise DnnvssError(f"a batch of {settings.batch_size} frames cannot be shared by {trainer.world_size} processes",
                          remedy="Choose trainer.batch_size as a multiple of trainer.devices times trainer.nodes")
    batches.place = lambda: (trainer.global_rank, trainer.world_size)
    if trainer.strategy.root_device.type == "cuda":
        batches.to(trainer.strategy.root_device)


def _loader(batches: Any) -> DataLoader:
    """A loader that takes nothing from torch's generator, which dropout draws from."""
    return DataLoader(batches, batch_size=None, generator=torch.Generator())


@contextmanager
def _quiet() -> Iterator[None]:
    with warnings.catch_warnings():
        for message in _LIGHTNING_CHATTER:
            warnings.filterwarnings("ignore", message=message)
        yield
