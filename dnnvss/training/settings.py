"""How a network is fitted; one flat table, mirrored by ``conf/trainer/*.yaml``."""

from dataclasses import dataclass, fields
from typing import Any

from dnnvss.errors import DnnvssError

LOG_VARIANCE = (-7.0, 3.0)
"""Range of predicted log variances, where 0 is the variance of the training frames."""

SHARING = ("nodes", "strategy", "graph")
"""Settings that share a fit out or speed it up and do not change what comes of it."""
_KINDS: dict[Any, tuple[tuple[type, ...], str]] = {
    int: ((int,), "whole number"), float: ((int, float), "number"), bool: ((bool,), "true or false"),
    str: ((str,), "word")}


@dataclass(frozen=True)
class FitSettings:
    """Settings of a fit.

    Args:
        optimizer: ``sgd`` (with ``momentum``) or ``adamw``.
        learning_rate: step size for the loss as reduced by ``reduction``.
        momentum: of ``sgd``.
        weight_decay: of either optimiser.
        schedule: ``constant``, or ``cosine`` down to zero at the last epoch.
        warmup: share of all steps over which the rate rises from zero.
        batch_size: frames a step.
        epochs: at most so many passes.
        share: part of the training frames drawn, anew, in each epoch; neighbours at 100 frames a second are redundant.
        patience: epochs without a better static error on the validation frames before the fit stops.
        reduction: ``sum`` or ``mean`` of the squared errors over the outputs (always the mean over the batch).
        stream_weights: weight of static, delta and delta-delta in the loss.
        clip: largest norm of the gradient.
        average: decay of the exponential average of the weights that is kept as the result; 0 keeps the last.
        together: train the members of a model in one pass, their matrices stacked, which suits small networks on a GPU.
            They share the best epoch, that of the least mean error, and the end of the fit.
        precision: ``32-true``, ``bf16-mixed``, or ``auto`` for bf16 where the device multiplies it in hardware.
        graph: on a GPU that works alone, record a step and replay it; the results are the same.
        compile: let torch.compile write kernels for the network; needs Triton on a GPU, a C++ compiler without.
        accelerator, devices: as Lightning takes them; devices are those of one machine.
        nodes: machines that share the fit.
        strategy: how devices share it: ``auto``, ``ddp``. A batch is shared out, so that results do not depend on it.
        seed: of initial weights, batches and dropout.
        progress: show a progress bar.
        figure_every: epochs between trajectory figures in TensorBoard; 0 for none.
        refine: passes over the utterances with parameter generation inside the loss, after the fit; 0 for none.
        refine_rate: step size of these passes.
        smoke: one batch and one epoch, to try a configuration.

    Raises:
        DnnvssError: a value that is none of the above.
    """

    optimizer: str = "adamw"
    learning_rate: float = 3e-3
    momentum: float = 0.9
    weight_decay: float = 0.0
    schedule: str = "cosine"
    warmup: float = 0.02
    batch_size: int = 512
    epochs: int = 12
    share: float = 0.5
    patience: int = 12
    reduction: str = "mean"
    stream_weights: tuple[float, ...] = (1.0, 0.5, 0.1)
    clip: float = 1.0
    average: float = 0.0
    together: bool = False
    precision: str = "32-true"
    graph: bool = True
    compile: bool = False
    accelerator: str = "auto"
    devices: int = 1
    nodes: int = 1
    strategy: str = "auto"
    seed: int = 0
    progress: bool = True
    figure_every: int = 5
    refine: int = 0
    refine_rate: float = 1e-4
    smoke: bool = False

    def __post_init__(self) -> None:
        choices = {"optimizer": ("sgd", "adamw"), "schedule": ("constant", "cosine"), "reduction": ("sum", "mean"),
                   "precision": ("32-true", "bf16-mixed", "auto")}
        for setting in fields(self):
            value, (kinds, name) = getattr(self, setting.name), _KINDS.get(setting.type, ((), ""))
            if kinds and (not isinstance(value, kinds) or (isinstance(value, bool) and setting.type is not bool)):
                raise DnnvssError(f"trainer.{setting.name}={value!r} is no {name}", remedy="Give one")
        for name, allowed in choices.items():
            if (value := getattr(self, name)) not in allowed:
                raise DnnvssError(f"trainer.{name}={value!r}", remedy=f"Use one of {list(allowed)}")
        for name in ("learning_rate", "batch_size", "epochs", "share", "clip", "refine_rate"):
            if getattr(self, name) <= 0:
                raise DnnvssError(f"trainer.{name}={getattr(self, name)} is not positive", remedy="Give more than 0")
        for name in ("momentum", "weight_decay", "warmup", "patience", "average", "refine", "figure_every"):
            if getattr(self, name) < 0:
                raise DnnvssError(f"trainer.{name}={getattr(self, name)} is negative", remedy="Give 0 or more")
        for name, remedy in (("share", "Give 1 at most"), ("warmup", "Give 1 at most"), ("average", "Give less than 1"),
                             ("momentum", "Give less than 1")):
            if (value := getattr(self, name)) > 1 or (value == 1 and remedy == "Give less than 1"):
                raise DnnvssError(f"trainer.{name}={value} is too much", remedy=remedy)
        object.__setattr__(self, "stream_weights", tuple(self.stream_weights))

    def diverged(self, where: str, value: float) -> DnnvssError:
        """Return the error that ends a fit whose loss is no number, or far beyond what saying nothing costs.

        Args:
            where: what was measured, and when.
            value: what it came to.
        """
        return DnnvssError(
            f"training diverged: {where} is {value:.4g} at learning rate {self.learning_rate} ({self.optimizer}, "
            f"reduction {self.reduction!r}, batch size {self.batch_size})",
            remedy="Lower trainer.learning_rate or trainer.clip; the run folder keeps the last good checkpoint")
