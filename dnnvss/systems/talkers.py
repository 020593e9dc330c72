"""Several talkers in one training: a network that they share, a code and an output for each, told apart afterwards."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Self

import numpy as np
import torch
from torch import Tensor

from dnnvss import files
from dnnvss.face.base import Face
from dnnvss.features import CodeStore, FeatureTable, NumericScaler
from dnnvss.systems.base import Example, Prediction, moments
from dnnvss.systems.figures import trajectory_figure
from dnnvss.systems.frame_network import FrameNetwork, NetworkPlan, filled
from dnnvss.systems.network import STILL, NetworkModel, NetworkSettings
from dnnvss.systems.unheard import heard_phones, lend_weights
from dnnvss.timing import FrameClock
from dnnvss.training.batches import FrameBatches
from dnnvss.training.recipe import descent
from dnnvss.training.regression import FrameRegression, UtteranceRegression
from dnnvss.training.utterances import UtteranceBatches

Heard = Mapping[str, Sequence[Example]]
"""Examples by talker."""
_CHUNK = 4096


class TalkersNetwork(FrameNetwork):
    """A network that says each frame on the face of the talker whose code stands behind the frame's columns.

    Inside is a network of any kind, with a column more for each talker and the outputs of all of them. What is given
    back of a frame are the outputs of its own talker, filled up with zeros to the widest face, so that nothing of the
    others is learnt from it.

    Args:
        plan: of the network inside.
        sizes: numbers of columns as :meth:`NetworkPlan.build` takes them, without those of the talkers.
        parameters: of each talker's face, D.
        rows: W, twice as many where variances are predicted.
    """

    def __init__(self, plan: NetworkPlan, sizes: Mapping[str, int], parameters: Sequence[int], rows: int) -> None:
        super().__init__()
        self.plan, self.sizes, self.rows, self.parameters_ = plan, dict(sizes), rows, tuple(parameters)
        self.binary, widest = sizes["binary"], max(parameters)
        self.out, self.over_time = rows * widest, plan.cls.over_time  # type: ignore[misc]
        self.ends = np.cumsum([rows * size for size in parameters]).tolist()
        self.inside = plan.build(binary=self.binary + len(parameters), numeric=sizes["numeric"],
                                 active=sizes["active"] + 1, out=self.ends[-1])
        places, known = np.zeros((2, len(parameters), rows, widest), np.int64)
        for k, size in enumerate(parameters):
            places[k, :, :size] = self.ends[k] - rows * size + np.arange(rows * size).reshape(rows, size)
            known[k, :, :size] = 1
        self.register_buffer("places", torch.from_numpy(places).flatten(1), persistent=False)
        self.register_buffer("known", torch.from_numpy(known).flatten(1).float(), persistent=False)

    def forward(self, active: Tensor, numeric: Tensor, lengths: Any = None) -> Tensor:
        """Outputs (N, rows x D of the widest face) of columns (N, A + 1), the last of which is the talker's."""
        talker = active[:, -1].long() - self.binary
        every = self.inside(active, numeric, lengths)
        return every.gather(1, self.get_buffer("places")[talker]) * self.get_buffer("known")[talker]

    def of(self, talker: int) -> FrameNetwork:
        """The network of one talker: the code becomes part of the first layer's bias, other talkers' outputs go."""
        own, size = self.binary + talker, self.rows * self.parameters_[talker]

        def build() -> FrameNetwork:
            return self.plan.build(**self.sizes, out=size)

        with torch.device("meta"):
            shapes = {name: weight.shape for name, weight in build().state_dict().items()}
        weights = {name: weight.detach().cpu() for name, weight in self.inside.state_dict().items()}
        columns = weights["first.weight"]
        weights["first.bias"] = weights["first.bias"] + columns[own]
        weights["first.weight"] = torch.cat([columns[: self.binary], columns[-1:]])
        outputs = slice(self.ends[talker] - size, self.ends[talker])
        return filled(build, {name: weight if weight.shape == shapes[name] else weight[outputs].clone()
                              for name, weight in weights.items()})


class TalkerCodes:
    """Frame codes of several talkers, behind whose active columns stands that of the talker.

    Args:
        store: codes of all utterances, S frames.
        talker: whose each frame is (S,), an array or a tensor.
        talkers: how many there are; their columns follow those of the labels.
    """

    def __init__(self, store: CodeStore, talker: Any, talkers: int) -> None:
        self.store, self.talker, self.talkers, self.arrays = store, talker, talkers, store.arrays

    def active(self, frames: Any) -> Any:
        """The active columns (B, A + 1) of frames; padding lies behind the columns of the talkers."""
        columns, binary = self.store.active(frames), self.store.table.binary_width
        if isinstance(columns, np.ndarray):
            own = binary + self.talker[frames].astype(np.int32)
            return np.concatenate([np.where(columns == binary, binary + self.talkers, columns), own[:, None]], axis=1)
        own = binary + self.talker[torch.as_tensor(frames, device=columns.device)].to(columns.dtype)
        return torch.cat([columns.masked_fill(columns == binary, binary + self.talkers), own[:, None]], dim=1)

    def numeric(self, frames: Any) -> Any:
        """The numbers (B, N) of frames."""
        return self.store.numeric(frames)

    def to(self, device: Any) -> Self:
        """The same with tensors on a device."""
        return type(self)(self.store.to(device), torch.as_tensor(self.talker, device=device), self.talkers)


def repeats(frames: Sequence[int], balance: float) -> list[int]:
    """How often the frames of each talker are passed over where the largest talker's are once.

    Args:
        frames: of each talker.
        balance: 0 for each frame alike, 1 for each talker alike.
    """
    return [max(1, round((max(frames) / count) ** balance)) for count in frames]


class TalkersFit:
    """One fit for several talkers, of which each gets a network of the usual kind.

    Targets are each talker's own parameters in units of their deviations; the error of a frame is the mean over the
    outputs of its talker, whatever their number.

    Args:
        table, clock, settings: as of :class:`NetworkModel`.
        balance: see :func:`repeats`.
        face: of the first talker, where figures of the fit are to show it.
    """

    def __init__(self, table: FeatureTable, clock: FrameClock, settings: NetworkSettings, balance: float,
                 face: Face | None = None) -> None:
        self.table, self.clock, self.settings, self.balance, self.face = table, clock, settings, balance, face
        self.plan = NetworkPlan.read(settings.network)

    def __call__(self, train: Heard, val: Heard, folder: Path) -> dict[str, NetworkModel]:
        """The fitted model of each talker.

        A fit that was killed goes on from what is kept in ``folder``.

        Args:
            train: examples of each talker.
            val: likewise; all of them choose the epoch.
            folder: of checkpoints.
        """
        models = {name: NetworkModel(self.table, self.clock, self.settings) for name in train}
        widest = max(e.measured[0].shape[2] for own in train.values() for e in own[:1])
        scaler = NumericScaler.fit(_store(train))
        for name, model in models.items():
            model.mean_, deviation = moments(train[name])
            model.deviation_ = np.maximum(deviation, STILL * deviation.max(axis=1, keepdims=True) + 1e-8)
            model.deviation_ *= np.sqrt(model.deviation_.shape[1] / widest, dtype=np.float32)
            model.scaler_, model.networks_ = scaler, []
        heard = heard_phones(e.codes for own in train.values() for e in own)
        for k in range(self.settings.members):
            home, seed = folder / f"member_{k + 1}" if k else folder, self.settings.fit.seed + k
            network = self._fit_member(models, train, val, home, seed)
            lend_weights(network.inside.get_submodule("first"), self.table, heard)
            for t, model in enumerate(models.values()):
                model.networks_.append(network.of(t).eval())
        for name, model in models.items():
            model.fit_variance(val[name])
        return models

    def _fit_member(self, models: Mapping[str, NetworkModel], train: Heard, val: Heard, folder: Path,
                    seed: int) -> TalkersNetwork:
        from dnnvss.training.fit import run_fit  # a run is opened without Lightning

        settings = replace(self.settings.fit, seed=seed, graph=self.settings.fit.graph and not self.plan.cls.over_time)
        torch.manual_seed(seed)
        faces = [model.mean_.shape for model in models.values()]
        sizes = {"binary": self.table.binary_width, "numeric": self.table.numeric_width,
                 "active": self.table.active_width}
        streams, parameters = faces[0][0], [size for _, size in faces]
        network = TalkersNetwork(self.plan, sizes, parameters, streams * (2 if self.settings.variances else 1))
        kind = UtteranceRegression if self.plan.cls.over_time else FrameRegression
        first, shown = next(iter(models)), NetworkModel(self.table, self.clock, self.settings)

        def preview(example: Example) -> Prediction:
            vars(shown).update(vars(models[first]), networks_=[network.of(0).eval()])
            return shown.predict(example)

        run_fit(network, kind(settings, streams, max(parameters)), descent(settings),
                self._batches(models, train, folder, seed), self._batches(models, val, folder), settings, folder,
                partial(trajectory_figure, val[first][0], preview, self.face))
        return network

    def _batches(self, models: Mapping[str, NetworkModel], heard: Heard, folder: Path,
                 seed: int | None = None) -> FrameBatches:
        """Batches of all talkers' frames, with targets that are normalised and filled up already."""
        s, every = self.settings.fit, [e for own in heard.values() for e in own]
        widest = max(model.mean_.shape[1] for model in models.values())
        talker = np.repeat(np.arange(len(heard)), [sum(len(e.codes) for e in own) for own in heard.values()])
        targets = files.mapped((_padded(e.measured[0], models[name], widest)
                                for name, own in heard.items() for e in own), folder)
        valid = np.concatenate([e.measured[1] for e in every])
        others = min(len(e.alternatives) for e in every) if seed is not None else 0
        store, *more = (TalkerCodes(_store(heard, k), talker, len(heard)) for k in (None, *range(others)))
        scaler = next(iter(models.values())).scaler_
        often = repeats(np.maximum(np.bincount(talker[valid], minlength=len(heard)), 1).tolist(), self.balance)
        if self.plan.cls.over_time:
            batches = UtteranceBatches(store, scaler, targets, valid, s.utterances, s.share, seed, alternatives=more)
            batches.parts = [part for part in batches.parts for _ in range(often[talker[part[0]]])]
            return batches
        frames = np.repeat(np.flatnonzero(valid), np.array(often)[talker[valid]])
        least = 1 if seed is None or s.smoke else -(-s.steps // s.epochs)
        size, share = (s.batch_size, s.share) if seed is not None else (_CHUNK, 1.0)
        return FrameBatches(store, scaler, targets, frames, size, share, seed, alternatives=more, least=least)


def _padded(targets: np.ndarray, model: NetworkModel, widest: int) -> np.ndarray:
    """Targets (T, W, D) normalised and with zeros behind, (T, W x D of the widest face) float32."""
    own = (targets - model.mean_) / model.deviation_
    return np.pad(own, ((0, 0), (0, 0), (0, widest - own.shape[2]))).reshape(len(own), -1).astype(np.float32)


def _store(heard: Heard, alternative: int | None = None) -> CodeStore:
    return CodeStore.join((f"{name}/{e.id}", e.codes if alternative is None else e.alternatives[alternative])
                          for name, own in heard.items() for e in own)
