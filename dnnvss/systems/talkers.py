"""Several talkers in one training: a network that they share, a code and an output for each, told apart afterwards."""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Self

import numpy as np
import torch
from torch import Tensor

from dnnvss import files
from dnnvss.face.base import APERTURE, LOWER_LIP, WIDTH, Face
from dnnvss.features import CodeStore, FeatureTable, NumericScaler
from dnnvss.systems.base import Example, Prediction, moments, pooled
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
LIPS = (APERTURE, WIDTH, LOWER_LIP)
"""The gauges that talkers share where their faces have them."""
_CHUNK = 4096


class TalkersNetwork(FrameNetwork):
    """A network that says each frame on the face of the talker whose code stands behind the frame's columns.

    Inside is a network of any kind, with a column more for each talker, the outputs of all of them, and outputs that
    they share. What is given back of a frame are the outputs of its own talker, filled up with zeros to the widest
    face, so that nothing of the others is learnt from it, and the shared ones.

    Args:
        plan: of the network inside.
        sizes: numbers of columns as :meth:`NetworkPlan.build` takes them, without those of the talkers.
        parameters: of each talker's face, D.
        rows: W, twice as many where variances are predicted.
        shared: values a row that mean the same for all talkers, G.
    """

    def __init__(self, plan: NetworkPlan, sizes: Mapping[str, int], parameters: Sequence[int], rows: int,
                 shared: int = 0) -> None:
        super().__init__()
        self.plan, self.sizes, self.rows, self.parameters_ = plan, dict(sizes), rows, tuple(parameters)
        self.binary, widest = sizes["binary"], max(parameters)
        self.out, self.over_time = rows * (widest + shared), plan.cls.over_time  # type: ignore[misc]
        self.ends = np.cumsum([rows * size for size in parameters]).tolist()
        self.inside = plan.build(binary=self.binary + len(parameters), numeric=sizes["numeric"],
                                 active=sizes["active"] + 1, out=self.ends[-1] + rows * shared)
        places, known = np.zeros((2, len(parameters), rows, widest + shared), np.int64)
        places[:, :, widest:] = self.ends[-1] + np.arange(rows * shared).reshape(rows, shared)
        known[:, :, widest:] = 1
        for k, size in enumerate(parameters):
            places[k, :, :size] = self.ends[k] - rows * size + np.arange(rows * size).reshape(rows, size)
            known[k, :, :size] = 1
        self.register_buffer("places", torch.from_numpy(places).flatten(1), persistent=False)
        self.register_buffer("known", torch.from_numpy(known).flatten(1).float(), persistent=False)

    def forward(self, active: Tensor, numeric: Tensor, lengths: Any = None) -> Tensor:
        """Outputs (N, rows x (D of the widest face + G)) of columns (N, A + 1), the last of which is the talker's."""
        talker = active[:, -1].long() - self.binary
        every = self.inside(active, numeric, lengths)
        return every.gather(1, self.get_buffer("places")[talker]) * self.get_buffer("known")[talker]

    def of(self, talker: int) -> FrameNetwork:
        """The network of one talker: the code becomes part of the first layer's bias, all other outputs go."""
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
    outputs of its talker, whatever their number. Where the faces have gauges of the lips in common, these, in units of
    the talker's own deviation, are further targets whose outputs all talkers share: what an opening mouth is to one is
    thereby an opening mouth to all. They are left behind when the fit has ended.

    Args:
        table, clock, settings: as of :class:`NetworkModel`.
        balance: see :func:`repeats`.
        faces: of each talker; those of a fit without gauges if left out.
    """

    def __init__(self, table: FeatureTable, clock: FrameClock, settings: NetworkSettings, balance: float,
                 faces: Mapping[str, Face] | None = None) -> None:
        self.table, self.clock, self.settings, self.balance, self.faces = table, clock, settings, balance, faces or {}
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
        told = {name: _Told.of(model, train[name], widest, self._gauges(name)) for name, model in models.items()}
        heard = heard_phones(e.codes for own in train.values() for e in own)
        for k in range(self.settings.members):
            home, seed = folder / f"member_{k + 1}" if k else folder, self.settings.fit.seed + k
            network = self._fit_member(models, told, train, val, home, seed)
            lend_weights(network.inside.get_submodule("first"), self.table, heard)
            for t, model in enumerate(models.values()):
                model.networks_.append(network.of(t).eval())
        for name, model in models.items():
            model.fit_variance(val[name])
        return models

    def _gauges(self, talker: str) -> np.ndarray | None:
        """The weights (D, G) of the lips' gauges that all faces have; None where faces are not known."""
        if not self.faces:
            return None
        names = [name for name in LIPS if all(name in face.gauges for face in self.faces.values())]
        gauges = self.faces[talker].gauges
        return np.stack([gauges[name].vector for name in names], axis=1) if names else None

    def _fit_member(self, models: Mapping[str, NetworkModel], told: "Mapping[str, _Told]", train: Heard, val: Heard,
                    folder: Path, seed: int) -> TalkersNetwork:
        from dnnvss.training.fit import run_fit  # a run is opened without Lightning

        settings = replace(self.settings.fit, seed=seed, graph=self.settings.fit.graph and not self.plan.cls.over_time)
        torch.manual_seed(seed)
        faces = [model.mean_.shape for model in models.values()]
        sizes = {"binary": self.table.binary_width, "numeric": self.table.numeric_width,
                 "active": self.table.active_width}
        streams, parameters = faces[0][0], [size for _, size in faces]
        width = next(iter(told.values())).width
        network = TalkersNetwork(self.plan, sizes, parameters, streams * (2 if self.settings.variances else 1),
                                 width - max(parameters))
        kind = UtteranceRegression if self.plan.cls.over_time else FrameRegression
        first = next(iter(models))
        shown = copy.copy(models[first])

        def preview(example: Example) -> Prediction:
            shown.networks_ = [network.of(0).eval()]
            return shown.predict(example)

        run_fit(network, kind(settings, streams, width), descent(settings),
                self._batches(shown.scaler_, told, train, folder, seed),
                self._batches(shown.scaler_, told, val, folder), settings, folder,
                partial(trajectory_figure, val[first][0], preview, self.faces.get(first)))
        return network

    def _batches(self, scaler: NumericScaler, told: "Mapping[str, _Told]", heard: Heard, folder: Path,
                 seed: int | None = None) -> FrameBatches:
        """Batches of all talkers' frames, with targets that are normalised and filled up already."""
        s, every = self.settings.fit, [e for own in heard.values() for e in own]
        talker = np.repeat(np.arange(len(heard)), [sum(len(e.codes) for e in own) for own in heard.values()])
        targets = files.mapped((told[name](e.measured[0]) for name, own in heard.items() for e in own), folder)
        valid = np.concatenate([e.measured[1] for e in every])
        others = min(len(e.further) for e in every) if seed is not None else 0
        store, *more = (TalkerCodes(_store(heard, k), talker, len(heard)) for k in (None, *range(others)))
        often = repeats(np.maximum(np.bincount(talker[valid], minlength=len(heard)), 1).tolist(), self.balance)
        if self.plan.cls.over_time:
            batches = UtteranceBatches(store, scaler, targets, valid, s.utterances, s.share, seed, alternatives=more)
            batches.parts = [part for part in batches.parts for _ in range(often[talker[part[0]]])]
            return batches
        frames = np.repeat(np.flatnonzero(valid), np.array(often)[talker[valid]])
        least = 1 if seed is None or s.smoke else -(-s.steps // s.epochs)
        size, share = (s.batch_size, s.share) if seed is not None else (_CHUNK, 1.0)
        return FrameBatches(store, scaler, targets, frames, size, share, seed, alternatives=more, least=least)


@dataclass(frozen=True)
class _Told:
    """What of a talker's targets the network is told.

    Args:
        mean, deviation: (W, D) of the parameters.
        gauges: weights (D, G).
        spread: deviations (W, G) of the gauges.
        width: D of the widest face and G, together.
    """

    mean: np.ndarray
    deviation: np.ndarray
    gauges: np.ndarray
    spread: np.ndarray
    width: int

    @classmethod
    def of(cls, model: NetworkModel, train: Sequence[Example], widest: int, gauges: np.ndarray | None) -> "_Told":
        """That of a talker whose training examples are known."""
        weights = np.zeros((model.mean_.shape[1], 0)) if gauges is None else gauges
        seen = (pooled(train) - model.mean_) @ weights
        return cls(model.mean_, model.deviation_, weights, seen.std(axis=0) + 1e-6, widest + weights.shape[1])

    def __call__(self, targets: np.ndarray) -> np.ndarray:
        """Targets (T, W, D) normalised, filled up with zeros, and the gauges behind them, (T, W x width) float32."""
        moved = targets - self.mean
        filled_up = np.zeros((*targets.shape[:2], self.width), np.float32)
        filled_up[:, :, : targets.shape[2]] = moved / self.deviation
        filled_up[:, :, self.width - self.gauges.shape[1] :] = moved @ self.gauges / self.spread
        return filled_up.reshape(len(targets), -1)


def _store(heard: Heard, further: int | None = None) -> CodeStore:
    return CodeStore.join((f"{name}/{e.id}", e.codes if further is None else e.further[further])
                          for name, own in heard.items() for e in own)
