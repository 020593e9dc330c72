"""A network behind the model interface: scaling, the fit, and prediction frame by frame."""

import copy
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from torch import Tensor, nn

from dnnvss import files
from dnnvss.features import CodeStore, FeatureTable, FrameCodes, NumericScaler
from dnnvss.systems.base import READABLE, Example, Prediction, PredictionStream, VisualModel, moments
from dnnvss.systems.figures import trajectory_figure
from dnnvss.systems.frame_network import FrameNetwork, NetworkPlan, filled
from dnnvss.systems.members import NetworkSettings
from dnnvss.systems.parts import pieces
from dnnvss.systems.stacked import StackedNetworks
from dnnvss.systems.unheard import heard_phones, lend_weights
from dnnvss.timing import FrameClock
from dnnvss.training.batches import FrameBatches
from dnnvss.training.recipe import descent, steady
from dnnvss.training.regression import FrameRegression, UtteranceRegression
from dnnvss.training.settings import LOG_VARIANCE, FitSettings
from dnnvss.training.trajectories import Join, TrajectoryError
from dnnvss.training.utterances import UtteranceBatches

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_CHUNK = 4096  # frames a pass over the validation frames
STILL = 1e-4
"""Least deviation of a coefficient as a share of the largest one: what hardly moves in training is not blown up."""


class NetworkModel(VisualModel):
    """A frame-wise network, or the mean of several, that predicts normalised streams from active columns.

    Members differ in the seed of their weights, batches and dropout; where they disagree, each has learnt noise of its
    own, and the mean of them is closer to the talker than any one.

    Args:
        table: the feature table of the labels.
        clock: the trajectory clock.
        settings: see :class:`NetworkSettings`. Variances that are predicted are scaled, for each stream and
            coefficient, so that they fit the errors on the validation frames. Otherwise the variance of those errors
            stands for all frames.

    Raises:
        DnnvssError: a kind of network that does not exist, or a setting that it refuses.
    """

    system = "network"
    reads = READABLE
    Settings = NetworkSettings
    settings: NetworkSettings

    def __init__(self, table: FeatureTable, clock: FrameClock, settings: NetworkSettings | None = None) -> None:
        super().__init__(table, clock, settings)
        self.plan = NetworkPlan.read(self.settings.network)
        self.members, self.variances = self.settings.members, self.settings.variances

    def fit(self, train: Sequence[Example], val: Sequence[Example], folder: Path) -> None:
        """Fit by gradient descent and keep the weights of the epoch with the least static error on ``val``.

        A fit that was killed goes on from the last whole epoch kept in ``folder/checkpoints`` and ends with the same
        weights as one that was not.
        """
        self.mean_, deviation = moments(train)
        self.deviation_ = np.maximum(deviation, STILL * deviation.max(axis=1, keepdims=True) + 1e-8)
        self.scaler_ = NumericScaler.fit(_store(train))
        self.networks_: list[FrameNetwork] = []
        if self.settings.fit.together and self.members > 1:
            self._fit_together(train, val, folder)
        else:
            for k in range(self.members):
                home = folder / f"member_{k + 1}" if k else folder
                self._fit_member(train, val, home, self.settings.fit.seed + k)
        heard = heard_phones(e.codes for e in train)
        for network in self.networks_:
            lend_weights(network.get_submodule("first"), self.table, heard)
            network.eval()
        self.fit_variance(val)

    def _fit_member(self, train: Sequence[Example], val: Sequence[Example], folder: Path, seed: int) -> None:
        settings = replace(self.settings.fit, seed=seed)
        torch.manual_seed(seed)
        self.networks_.append(network := self._new_network())
        self._run(network, self._batches(train, folder, seed), self._batches(val, folder), settings, folder,
                  partial(trajectory_figure, val[0], self.predict, self.face))

    def _fit_together(self, train: Sequence[Example], val: Sequence[Example], folder: Path) -> None:
        settings = self.settings.fit
        for k in range(self.members):
            torch.manual_seed(settings.seed + k)
            self.networks_.append(self._new_network())
        stack = StackedNetworks(self.networks_)

        def preview(example: Example) -> Prediction:
            stack.unstack(self.networks_)
            return self.predict(example)

        self._run(stack, self._batches(train, folder, settings.seed, self.members),
                  self._batches(val, folder, members=self.members), settings, folder,
                  partial(trajectory_figure, val[0], preview, self.face))
        stack.unstack(self.networks_)

    def _run(self, network: nn.Module, train: FrameBatches, val: FrameBatches, settings: FitSettings, folder: Path,
             figure: Callable[[], "Figure"]) -> None:
        from dnnvss.training.fit import run_fit  # a run is opened without Lightning

        kind = UtteranceRegression if self.plan.cls.over_time else FrameRegression
        if self.plan.cls.over_time:
            settings = replace(settings, graph=False)  # batches differ in their frames: no step is like another
        objective = kind(settings, *self.mean_.shape)
        run_fit(network, objective, descent(settings, getattr(network, "members", 1)), train, val, settings, folder,
                figure)

    def refine(self, train: Sequence[Example], val: Sequence[Example], join: Join, folder: Path) -> None:
        """Train the fitted networks on their generated trajectories, see :class:`TrajectoryError`.

        The passes that the settings ask for are made, and the weights of the best one kept, or those of before where
        none is better. A refinement that was killed goes on from its last pass.

        Args:
            train, val: examples; ``val`` chooses the pass.
            join: parameter generation of the task.
            folder: of checkpoints.
        """
        objective = TrajectoryError(self._decode, join, torch.from_numpy(self.deviation_[0].astype(np.float32)))
        for k, network in enumerate(self.networks_):
            network.cpu()
            home = folder / f"member_{k + 1}" if k else folder
            errors = self._refine_member(network, objective, train, val, home, self.settings.fit.seed + k)
            network.eval()
            print("trajectory error on validation, pass by pass: " + ", ".join(f"{v:.4f}" for v in errors))
        self.fit_variance(val)

    def _refine_member(self, network: FrameNetwork, objective: TrajectoryError, train: Sequence[Example],
                       val: Sequence[Example], folder: Path, seed: int) -> list[float]:
        """The error before the first pass, and after each."""
        from dnnvss.training.fit import alone, measure, run_fit

        s, given = self.settings.fit, copy.deepcopy(network.state_dict())
        settings = replace(alone(s), epochs=s.refine, patience=s.refine, learning_rate=s.refine_rate, seed=seed)
        ours, held = (self._utterances(part, folder, own, raw=True) for part, own in ((train, seed), (val, None)))
        before = measure(network, objective, held)
        errors = run_fit(network, objective, steady(settings), ours, held, settings, folder)
        if before < min(errors):
            network.load_state_dict(given)
        return [before, *errors]

    def predict(self, example: Example) -> Prediction:
        """Return mean streams and variances: predicted ones, or those of the errors on the validation frames.

        Members, and labels that may be true as well, are equal parts of a mixture, whose mean and variance are given.
        """
        return _gaussian(*self._mixture(example))

    def predictor(self, example: Example) -> Callable[[slice], tuple[np.ndarray, np.ndarray]]:
        """What gives mean and variance of slices of one utterance; a network goes through no more than a slice."""
        def predicted(around: slice) -> tuple[np.ndarray, np.ndarray]:
            said = _gaussian(*self._mixture(example, around))
            return said.mean, said.variance

        return predicted

    @property
    def lookahead(self) -> int | None:
        """Frames behind its own that a prediction depends on; None for all of the utterance."""
        return self.networks_[0].lookahead

    def stream(self) -> "PredictionStream":
        """A new utterance whose frames arrive bit by bit; see :meth:`VisualModel.stream`."""
        return super().stream() if self.lookahead is None else _Stream(self)

    def _mixture(self, example: Example, around: slice | None = None
                 ) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """Return the mean of the parts, the mean of their own variances and the variance of their means, (T, W, D).

        The last is None where there is but one part, or variances are not predicted.
        """
        every = (example.codes, *example.alternatives)
        return self._mixed(np.concatenate([self._forward(codes, around) for codes in every]))

    def _mixed(self, outputs: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        parts = [self._decode(torch.from_numpy(o)) for o in outputs]
        if len(parts) == 1:
            return parts[0][0].numpy(), parts[0][1].numpy(), None
        mean = torch.stack([m for m, _ in parts])
        own = torch.stack([v for _, v in parts]).mean(0)
        return mean.mean(0).numpy(), own.numpy(), mean.var(0, unbiased=False).numpy() if self.variances else None

    def _decode(self, outputs: Tensor) -> tuple[Tensor, Tensor]:
        """Return means and variances (frames, W, D), in parameter units, of outputs (frames, ...)."""
        shape, size = (-1, *self.mean_.shape), self.mean_.size
        centre, spread = (torch.from_numpy(a.astype(np.float32)) for a in (self.mean_, self.deviation_))
        mean = outputs[:, :size].reshape(shape) * spread + centre
        scale = torch.from_numpy(getattr(self, "variance_", self.deviation_**2))
        if not self.variances:
            return mean, scale.expand(mean.shape)
        own = outputs[:, size:].reshape(shape).clamp(*LOG_VARIANCE).double().exp()
        return mean, own * torch.from_numpy(self.deviation_.astype(np.float64)) ** 2 * scale

    def fit_variance(self, val: Sequence[Example]) -> None:
        """Take the variance of the errors on the validation frames, or what predicted variances are to be scaled by."""
        self.variance_ = np.ones(self.mean_.shape)
        found = [(*e.measured, *self._mixture(e)) for e in val]
        error = np.concatenate([(mean - targets)[valid] for targets, valid, mean, _, _ in found]).astype(np.float64)
        if not self.variances:
            self.variance_ = error.var(0) + 1e-12
            return
        own = np.concatenate([own[valid] for _, valid, _, own, _ in found]).astype(np.float64)
        between = [between[valid] for _, valid, *_, between in found if between is not None]
        self.variance_ = _scale(np.square(error), own, np.concatenate(between).astype(np.float64) if between else None)

    def state(self) -> dict[str, Any]:
        """Return weights, scalers and error variances."""
        return {
            "networks": [{k: v.detach().cpu().numpy() for k, v in n.state_dict().items()} for n in self.networks_],
            "scaler": self.scaler_.describe(),
            "mean": self.mean_, "deviation": self.deviation_, "variance": self.variance_,
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """Take over weights, scalers and error variances."""
        self.mean_, self.deviation_, self.variance_ = (state[n] for n in ("mean", "deviation", "variance"))
        self.scaler_ = NumericScaler.from_description(state["scaler"])
        told = [{name: torch.from_numpy(array) for name, array in weights.items()} for weights in state["networks"]]
        self.networks_ = [filled(self._new_network, weights).eval() for weights in told]

    def _new_network(self) -> FrameNetwork:
        return self.plan.build(binary=self.table.binary_width, numeric=self.table.numeric_width,
                               active=self.table.active_width, out=self.mean_.size * (2 if self.variances else 1))

    def _batches(self, examples: Sequence[Example], folder: Path, seed: int | None = None,
                 members: int = 1) -> FrameBatches:
        """Return batches of targets, normalised as they are drawn.

        A network over time gets whole utterances.
        """
        if self.plan.cls.over_time:
            return self._utterances(examples, folder, seed)
        targets, valid = self._targets(examples, folder)
        s = self.settings.fit
        drawn: tuple[int, float, int | None] = (_CHUNK, 1.0, None)
        if seed is not None:
            drawn = (s.batch_size, s.share, seed)
        others = min(len(e.further) for e in examples) if seed is not None else 0
        least = 1 if seed is None or s.smoke else -(-s.steps // s.epochs)
        return FrameBatches(_store(examples), self.scaler_, targets, np.flatnonzero(valid), *drawn, members,
                            normal=(self.mean_.ravel(), self.deviation_.ravel()),
                            alternatives=[_store(examples, k) for k in range(others)], least=least)

    def _utterances(self, examples: Sequence[Example], folder: Path, seed: int | None = None,
                    raw: bool = False) -> UtteranceBatches:
        """Batches of whole utterances; ``raw`` ones are all seen, with the main codes and targets as they are."""
        targets, valid = self._targets(examples, folder)
        s, further = self.settings.fit, min(len(e.further) for e in examples)
        others = range(further if seed is not None and not raw else 0)
        normal = None if raw else (self.mean_.ravel(), self.deviation_.ravel())
        return UtteranceBatches(_store(examples), self.scaler_, targets, valid, s.utterances, 1.0 if raw else s.share,
                                seed, alternatives=[_store(examples, k) for k in others], normal=normal)

    def _targets(self, examples: Sequence[Example], folder: Path) -> tuple[np.ndarray, np.ndarray]:
        """The targets (S, W x D) of all frames and which were measured (S,).

        Where the examples do not share one array already, it is mapped from a file without a name in ``folder``.
        """
        parts = [e.measured[0] for e in examples]
        targets = files.shared(parts)
        if targets is None:
            targets = files.mapped((part.astype(np.float32, copy=False) for part in parts), folder)
        valid = np.concatenate([e.measured[1] for e in examples])
        return targets.reshape(len(valid), -1), valid

    @torch.inference_mode(False)  # in which a network that is moved could not be trained any more
    @torch.no_grad()
    def _forward(self, codes: FrameCodes, around: slice | None = None) -> np.ndarray:
        """Return the outputs of every member, normalised, shape (members, T, W x D or twice as many); of a slice."""
        device = next(self.networks_[-1].parameters()).device
        training, out = [n.training for n in self.networks_], []
        for network in self.networks_:
            network.eval()
        for put_in, counting in pieces(len(codes), self.networks_[-1].reach, around=around):
            frames = np.arange(put_in.start, put_in.stop)
            active = torch.from_numpy(codes.active(frames)).to(device)
            numeric = torch.from_numpy(self.scaler_(codes.numeric(frames))).to(device)
            outputs = torch.stack([n.to(device)(active, numeric).float()[counting] for n in self.networks_])
            out.append(outputs.cpu().numpy())
        for network, mode in zip(self.networks_, training, strict=True):
            network.train(mode)
        return np.concatenate(out, axis=1)


class _Stream(PredictionStream):
    """Predictions of a causal network, or of the mean of several, while frames arrive."""

    def __init__(self, model: NetworkModel) -> None:
        self.model, self.streams = model, [network.cpu().eval().stream() for network in model.networks_]

    @torch.no_grad()
    def push(self, active: np.ndarray, numeric: np.ndarray) -> Prediction:
        """The frames that are settled once these came in."""
        columns = torch.from_numpy(np.asarray(active, np.int32))
        numbers = torch.from_numpy(self.model.scaler_(np.asarray(numeric, np.float32)))
        return self._told([stream.push(columns, numbers) for stream in self.streams])

    @torch.no_grad()
    def finish(self) -> Prediction:
        """The frames that were held back."""
        return self._told([stream.finish() for stream in self.streams])

    def _told(self, outputs: Sequence[Tensor]) -> Prediction:
        if not len(outputs[0]):
            return Prediction(*np.zeros((2, 0, *self.model.mean_.shape)))
        return _gaussian(*self.model._mixed(torch.stack(list(outputs)).numpy()))


def _gaussian(mean: np.ndarray, own: np.ndarray, between: np.ndarray | None) -> Prediction:
    return Prediction(mean, own if between is None else own + between)


def _scale(squares: np.ndarray, own: np.ndarray, between: np.ndarray | None) -> np.ndarray:
    """Return s, where the mean over frames of ``squares / (s own + between)`` is 1, or as near to it as a small s gets.

    All are (frames, W, D); s is (W, D).
    """
    alone = (squares / own).mean(0) + 1e-12
    if between is None:
        return alone
    low, high = np.full(alone.shape, 1e-12), alone  # more than alone is never needed
    for _ in range(60):
        middle = np.sqrt(low * high)
        above = (squares / (middle * own + between)).mean(0) > 1
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    return np.sqrt(low * high)


def _store(examples: Sequence[Example], further: int | None = None) -> CodeStore:
    return CodeStore.join((e.id, e.codes if further is None else e.further[further]) for e in examples)
