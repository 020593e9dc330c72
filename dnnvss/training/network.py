"""A network behind the model interface: scaling, the fit, and prediction frame by frame."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import nn

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.labels import CodeStore, FeatureTable, FrameCodes, NumericScaler
from dnnvss.models import Example, Prediction, VisualModel
from dnnvss.models.base import pooled
from dnnvss.timing import FrameClock
from dnnvss.training.batches import FrameBatches
from dnnvss.training.settings import FitSettings

_CHUNK = 4096  # frames a forward pass at prediction: bounds memory on an hour of text


class NetworkModel(VisualModel):
    """A frame-wise network, or the mean of several, that predicts normalised streams from active columns.

    Members differ in the seed of their weights, batches and dropout; where they disagree, each has learnt noise of its
    own, and the mean of them is closer to the talker than any one.

    Args:
        table: the feature table of the labels.
        clock: the trajectory clock.
        network: builds the network from ``binary``, ``numeric``, ``active`` and ``out`` (see
            :class:`dnnvss.models.FeedForward`).
        settings: of the fit.
        members: how many networks are fitted and averaged.

    Raises:
        DnnvssError: less than one member.
    """

    def __init__(self, table: FeatureTable, clock: FrameClock, network: Callable[..., nn.Module],
                 settings: FitSettings, members: int = 1) -> None:
        super().__init__(table, clock)
        if members < 1:
            raise DnnvssError(f"model.members={members} is less than one", remedy="Give 1 or more")
        self.build, self.settings, self.members = network, settings, members

    def fit(self, train: Sequence[Example], val: Sequence[Example], folder: Path) -> None:
        """Fit by gradient descent and keep the weights of the epoch with the least static error on ``val``.

        A fit that was killed goes on from the last whole epoch kept in ``folder/checkpoints`` and ends with the same
        weights as one that was not.
        """
        from dnnvss.training.fit import run_fit

        frames = pooled(train)
        self.mean_, self.deviation_ = frames.mean(0), np.maximum(frames.std(0), 1e-8)
        self.scaler_ = NumericScaler.fit(_store(train))
        self.networks_: list[nn.Module] = []
        for k in range(self.members):
            settings = replace(self.settings, seed=self.settings.seed + k)
            torch.manual_seed(settings.seed)
            self.networks_.append(network := self._new_network())
            run_fit(network, self._batches(train, settings.seed), self._batches(val), settings,
                    streams=self.mean_.shape[0], dimensions=self.mean_.shape[1],
                    folder=folder / f"member_{k + 1}" if k else folder, preview=(val[0], self.predict))
            network.eval()
        self.variance_ = np.ones_like(self.mean_)
        errors = [(self.predict(e).mean - e.targets)[e.valid] for e in val]  # type: ignore[operator]
        self.variance_ = np.concatenate(errors).astype(np.float64).var(0) + 1e-12

    def predict(self, example: Example) -> Prediction:
        """Return mean streams and their error variance on the validation frames."""
        known = [self._forward(codes) for codes in (example.codes, *example.alternatives)]
        normalised = np.mean(known, axis=0).reshape(-1, *self.mean_.shape)
        variance = getattr(self, "variance_", self.deviation_**2)
        return Prediction(normalised * self.deviation_ + self.mean_, np.broadcast_to(variance, normalised.shape))

    def state(self) -> dict[str, Any]:
        """Return weights, scalers and error variances."""
        arrays = {"mean": self.mean_, "deviation": self.deviation_, "variance": self.variance_}
        return {
            "networks": [{k: v.detach().cpu() for k, v in n.state_dict().items()} for n in self.networks_],
            "scaler": self.scaler_.describe(),
            **{name: torch.from_numpy(np.ascontiguousarray(a)) for name, a in arrays.items()},
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """Take over weights, scalers and error variances."""
        self.mean_, self.deviation_, self.variance_ = (state[n].numpy() for n in ("mean", "deviation", "variance"))
        self.scaler_ = NumericScaler.from_description(state["scaler"])
        self.networks_ = [self._new_network().eval() for _ in state["networks"]]
        for network, weights in zip(self.networks_, state["networks"], strict=True):
            network.load_state_dict(weights)

    def _new_network(self) -> nn.Module:
        return self.build(binary=self.table.binary_width, numeric=self.table.numeric_width,
                          active=self.table.active_width, out=self.mean_.size)

    def _batches(self, examples: Sequence[Example], seed: int | None = None) -> FrameBatches:
        targets = np.concatenate([(e.targets - self.mean_) / self.deviation_ for e in examples])
        valid = np.concatenate([e.valid for e in examples])  # type: ignore[list-item]
        s = self.settings
        drawn = (s.batch_size, s.share, seed) if seed is not None else (_CHUNK, 1.0, None)
        others = min(len(e.alternatives) for e in examples) if seed is not None else 0
        return FrameBatches(_store(examples), self.scaler_, targets.reshape(len(targets), -1).astype(np.float32),
                            np.flatnonzero(valid), *drawn, alternatives=[_store(examples, k) for k in range(others)])

    @torch.inference_mode()
    def _forward(self, codes: FrameCodes) -> np.ndarray:
        device = next(self.networks_[-1].parameters()).device
        training, out = self.networks_[-1].training, []
        self.networks_[-1].eval()
        for start in range(0, len(codes), _CHUNK):
            frames = np.arange(start, min(start + _CHUNK, len(codes)))
            active = torch.from_numpy(codes.active(frames)).to(device)
            numeric = torch.from_numpy(self.scaler_(codes.numeric(frames))).to(device)
            mean = torch.stack([n.to(device)(active, numeric).float() for n in self.networks_]).mean(0)
            out.append(mean.cpu().numpy())
        self.networks_[-1].train(training)
        return np.concatenate(out)


def _store(examples: Sequence[Example], alternative: int | None = None) -> CodeStore:
    return CodeStore.join((e.id, e.codes if alternative is None else e.alternatives[alternative]) for e in examples)


def load_checkpoint(path: Path) -> dict[str, Any]:
    """Return the tensors and plain containers in a checkpoint.

    Raises:
        DnnvssError: the file is missing, cut short, or holds anything but tensors and plain containers.
    """
    remedy = "Delete it and run the same train.py command again"
    state = files.read(path, lambda p: torch.load(p, map_location="cpu", weights_only=True), remedy)
    if not isinstance(state, dict):
        raise DnnvssError("is not a checkpoint of this package", file=path, remedy=remedy)
    return state


def save_checkpoint(path: Path, state: dict[str, Any]) -> None:
    """Write tensors and plain containers to ``path``, whole or not at all."""
    with files.replacing(path) as temporary:
        torch.save(state, temporary)
