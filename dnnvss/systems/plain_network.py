"""A fitted feed-forward network in NumPy: it predicts what :class:`~dnnvss.systems.network.NetworkModel` does, and
needs no torch."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.features import FeatureTable, FrameCodes, NumericScaler
from dnnvss.settings import read_settings
from dnnvss.systems.base import READABLE, Example, Prediction, PredictionStream, VisualModel
from dnnvss.systems.layers import FeedForwardSettings, Layers
from dnnvss.systems.parts import pieces
from dnnvss.timing import FrameClock
from dnnvss.training.settings import LOG_VARIANCE

_LEARNS_NOT = "a network that was opened to speak learns no more"


class PlainNetwork(VisualModel):
    """What a fitted network, or several, say of each frame. Made by :meth:`of`.

    Differs from :class:`~dnnvss.systems.network.NetworkModel` by rounding: at most 1e-5 of a deviation.

    Args:
        table, clock: as every system has them.
        members: the networks.
        scaler: of the numeric columns.
        streams: ``mean``, ``deviation`` and ``variance`` (W, D).
        variances: whether the networks tell log variances behind the means.
        learnt: all that as :meth:`NetworkModel.state` gave it.
    """

    reads = READABLE

    def __init__(self, table: FeatureTable, clock: FrameClock, members: Sequence[Layers], scaler: NumericScaler,
                 streams: Mapping[str, np.ndarray], variances: bool, learnt: Mapping[str, Any]) -> None:
        super().__init__(table, clock)
        self.learnt = learnt
        self.members, self.scaler, self.variances = tuple(members), scaler, variances
        self.shape = streams["mean"].shape
        self.centre, self.spread = (streams[name].astype(np.float32) for name in ("mean", "deviation"))
        self.variance = streams["variance"].astype(np.float64)
        self.own = np.square(streams["deviation"].astype(np.float64)) * self.variance

    @staticmethod
    def serves(model: Mapping[str, Any]) -> bool:
        """Whether a system of these settings, as in its file of ``conf/model``, can be one of this class."""
        network = model.get("network")
        return (model.get("system", model.get("name")) == "network" and isinstance(network, Mapping)
                and network.get("kind") == "feedforward")

    @classmethod
    def of(cls, model: Mapping[str, Any], table: FeatureTable, clock: FrameClock, state: Mapping[str, Any]
           ) -> "PlainNetwork | None":
        """The network that settings and a state describe; None where the weights are not those of the settings.

        Args:
            model: settings that it :meth:`serves`.
            table, clock: of the labels.
            state: what :meth:`NetworkModel.state` gave, as arrays.

        Raises:
            DnnvssError: a setting that a feed-forward network refuses.
            Exception: what a damaged state leads to.
        """
        size = {name: value for name, value in model["network"].items() if name != "kind"}
        settings = read_settings(FeedForwardSettings, size, "model.network")
        variances = model.get("variances", False) is True
        streams = {name: state[name] for name in ("mean", "deviation", "variance")}
        shape = streams["mean"].shape
        made = [Layers.of(weights, settings, table.binary_width, table.numeric_width,
                          streams["mean"].size * (2 if variances else 1)) for weights in state["networks"]]
        members = [layers for layers in made if layers is not None]
        scaler = NumericScaler.from_description(state["scaler"])
        if not members or len(members) < len(made) or {s.shape for s in streams.values()} != {shape}:
            return None
        return cls(table, clock, members, scaler, streams, variances, state)

    def predict(self, example: Example) -> Prediction:
        """Return mean streams and variances, those of the mixture of members and of labels that may be true as well."""
        return self._said(example, slice(0, len(example.codes)))

    def predictor(self, example: Example) -> Callable[[slice], tuple[np.ndarray, np.ndarray]]:
        """What gives mean and variance of slices of one utterance, in the memory of a slice."""
        def predicted(around: slice) -> tuple[np.ndarray, np.ndarray]:
            said = self._said(example, around)
            return said.mean, said.variance

        return predicted

    @property
    def lookahead(self) -> int:
        """None are needed."""
        return 0

    def stream(self) -> PredictionStream:
        """A new utterance whose frames arrive bit by bit."""
        return _Stream(self)

    def fit(self, train: Sequence[Example], val: Sequence[Example], folder: Path) -> None:
        """Refuse: nothing is learnt here."""
        raise DnnvssError(_LEARNS_NOT, remedy="Train a run: dnnvss train")

    def state(self) -> dict[str, Any]:
        """What it was made of."""
        return dict(self.learnt)

    def load_state(self, state: dict[str, Any]) -> None:
        """Refuse: the state is the file."""
        raise DnnvssError(_LEARNS_NOT, remedy="Open its file")

    def told(self, active: np.ndarray, numeric: np.ndarray) -> list[np.ndarray]:
        """The outputs (T, out) of each member for columns (T, A) and numbers (T, N) as codes give them."""
        numbers = self.scaler(np.asarray(numeric, np.float32))
        return [layers(active, numbers) for layers in self.members]

    def mixed(self, outputs: Sequence[np.ndarray]) -> Prediction:
        """The Gaussian of a mixture whose parts are alike, each told by outputs (T, out)."""
        size, frames = self.centre.size, len(outputs[0])
        means = [(o[:, :size].reshape(frames, *self.shape) * self.spread) + self.centre for o in outputs]
        if not self.variances:
            return Prediction(means[0] if len(means) == 1 else np.mean(means, axis=0), self.variance)
        logs = [o[:, size:].reshape(frames, *self.shape).clip(*LOG_VARIANCE) for o in outputs]
        own = np.mean([np.exp(log, dtype=np.float64) * self.own for log in logs], axis=0)
        if len(means) == 1:
            return Prediction(means[0], own)
        return Prediction(np.mean(means, axis=0), own + np.var(means, axis=0))

    def _said(self, example: Example, around: slice) -> Prediction:
        told: list[np.ndarray] = []
        for codes in (example.codes, *example.alternatives):
            parts = [self._part(codes, put_in) for put_in, _ in pieces(len(codes), (0, 0), around=around)]
            told += parts[0] if len(parts) == 1 else [np.concatenate(member) for member in zip(*parts, strict=True)]
        return self.mixed(told)

    def _part(self, codes: FrameCodes, frames: slice) -> list[np.ndarray]:
        at = np.arange(frames.start, frames.stop)
        return self.told(codes.active(at), codes.numeric(at))


class _Stream(PredictionStream):
    """Predictions while frames arrive: each is settled as it comes in."""

    def __init__(self, model: PlainNetwork) -> None:
        self.model = model

    def push(self, active: np.ndarray, numeric: np.ndarray) -> Prediction:
        """The frames that came in."""
        if not len(active):
            return self.finish()
        return self.model.mixed(self.model.told(active, numeric))

    def finish(self) -> Prediction:
        """Nothing: no frame was held back."""
        return Prediction(*np.zeros((2, 0, *self.model.shape)))
