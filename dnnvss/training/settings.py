"""How a network is fitted; one flat table, mirrored by ``conf/trainer/*.yaml``."""

from dataclasses import dataclass

from dnnvss.settings import check_settings, setting

LOG_VARIANCE = (-7.0, 3.0)
"""Range of predicted log variances, where 0 is the variance of the training frames."""

SHARING = ("nodes", "strategy", "graph")
"""Settings that share a fit out or speed it up and do not change what comes of it."""


@dataclass(frozen=True)
class FitSettings:
    """Settings of a fit.

    Args:
        optimizer: ``sgd`` (with ``momentum``) or ``adamw``.
        learning_rate: step size for the loss as reduced by ``reduction``.
        base_width: of ``adamw``: inputs of a linear layer up to which the rate is as said; where there are more, it
            falls in proportion, without which wide and deep networks learn nothing. 0 leaves it.
        momentum: of ``sgd``.
        weight_decay: of either optimiser.
        schedule: ``constant``, or ``cosine`` down to zero at the last epoch.
        warmup: share of all steps over which the rate rises from zero.
        batch_size: frames a step.
        utterances: whole utterances a step, of networks over time and of the passes of ``refine``.
        epochs: at most so many passes.
        steps: optimisation steps at least: where all epochs together have fewer, each passes over the frames several
            times. What ten sentences need is steps, and a pass over them has five. Not of networks over time.
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
            ``alone`` takes no notice of a cluster that the process is part of.
        altered: copies of each training recording with another throat, noise, band or level, from which networks whose
            labels read the sound learn in turn with the recording itself (:func:`dnnvss.acoustics.alter.altered`).
        seed: of initial weights, batches and dropout.
        progress: show a progress bar.
        figure_every: epochs between trajectory figures in TensorBoard; 0 for none.
        refine: passes over the utterances with parameter generation inside the loss, after the fit; 0 for none.
        refine_rate: step size of these passes.
        smoke: one batch and one epoch, to try a configuration.

    Raises:
        DnnvssError: a value of another type, range or choice.
    """

    optimizer: str = setting("adamw", choices=("sgd", "adamw"))
    learning_rate: float = setting(3e-3, above=0)
    base_width: int = setting(512, least=0)
    momentum: float = setting(0.9, least=0, below=1)
    weight_decay: float = setting(0.0, least=0)
    schedule: str = setting("cosine", choices=("constant", "cosine"))
    warmup: float = setting(0.02, least=0, most=1)
    batch_size: int = setting(512, least=1)
    utterances: int = setting(8, least=1)
    epochs: int = setting(12, least=1)
    steps: int = setting(0, least=0)
    share: float = setting(0.5, above=0, most=1)
    patience: int = setting(12, least=0)
    reduction: str = setting("mean", choices=("sum", "mean"))
    stream_weights: tuple[float, ...] = setting((1.0, 0.5, 0.1), least=0)
    clip: float = setting(1.0, above=0)
    average: float = setting(0.0, least=0, below=1)
    together: bool = False
    precision: str = setting("32-true", choices=("32-true", "bf16-mixed", "auto"))
    graph: bool = True
    compile: bool = False
    accelerator: str = "auto"
    devices: int = 1
    nodes: int = setting(1, least=1)
    strategy: str = "auto"
    altered: int = setting(0, least=0, most=20)
    seed: int = setting(0, least=0)
    progress: bool = True
    figure_every: int = setting(5, least=0)
    refine: int = setting(0, least=0)
    refine_rate: float = setting(1e-4, above=0)
    smoke: bool = False

    def __post_init__(self) -> None:
        check_settings(self, "trainer")
