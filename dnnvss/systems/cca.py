"""What is seen as a linear function of what is heard: canonical correlation and regression."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import nnls

from dnnvss.curves import STATIC_DELTA_DELTA2, derivatives, smoothing_spline
from dnnvss.face.base import Face, largest_groups
from dnnvss.features import FeatureTable
from dnnvss.settings import check_settings, setting
from dnnvss.systems.base import READABLE, Example, Prediction, VisualModel
from dnnvss.systems.context import inputs, offsets
from dnnvss.systems.mapping import AudioVisual, Pairs, fit_mapping
from dnnvss.timing import FrameClock


@dataclass(frozen=True)
class CanonicalSettings:
    """The settings of :class:`CanonicalRegression`."""

    context: int = setting(1, least=0, doc="frames on each side that are seen too (t)")
    step: float = setting(0.04, above=0, doc="seconds from one frame of context to the next")
    apart: bool = setting(True, doc="whether groups of parameters (shape, texture) have mappings of their own")
    factors: int | None = setting(None, least=1, doc="canonical factors that are kept; all where null")
    ridge: float = setting(0.0, least=0, doc="regularisation, in variances of each variable; 0: none")
    cutoff: float | None = setting(8.0, above=0, doc="Hz of the cubic smoothing spline; null for none")
    regions: int = setting(1, least=1, doc="clusters of what is heard, each with a mapping of its own")
    blocks: str = setting("together", choices=("together", "averaged"),
                          doc="blocks of labels in one mapping, or a mapping each and the mean of them by their worth")

    def __post_init__(self) -> None:
        check_settings(self, "model")


class CanonicalRegression(VisualModel):
    """Canonical correlation of labels and parameters, linear regression, and a smoothing spline.

    A frame is one matrix product, ``v = tau Wa' a``, of the columns of the labels in the frame and in ``context``
    frames on each side; nothing else of the sentence is looked at but by the spline. With all factors, mappings apart
    and together are the same; with fewer they are not.

    **Source**: Theobald and Wilkinson 2007, sections 3.2 (mapping), 4.3 (context), 5 (spline) and 6 (several features
    in one mapping, several mappings by the sound).

    Args:
        table: the feature table of the labels; all its columns are used.
        clock: the trajectory clock.
        settings: see :class:`CanonicalSettings`.
    """

    system = "cca"
    reads = READABLE
    Settings = CanonicalSettings
    settings: CanonicalSettings

    def __init__(self, table: FeatureTable, clock: FrameClock, settings: CanonicalSettings | None = None) -> None:
        super().__init__(table, clock, settings)
        self.places = offsets(self.settings.context, self.settings.step, clock)
        self.groups: tuple[tuple[int, ...], ...] = ()

    def take_face(self, face: Face) -> None:
        """Regress the face's groups of parameters apart, where the settings say so."""
        self.groups = tuple(largest_groups(face.groups).values()) if self.settings.apart else ()

    def fit(self, train: Sequence[Example], val: Sequence[Example], folder: Path) -> None:
        """Regress the training frames; ``val`` weighs averaged mappings and measures the error."""
        pairs, held = self._pairs(train), self._pairs(val)
        s, size = self.settings, pairs[0][1].shape[1]
        groups = self.groups or (tuple(range(size)),)
        self.mappings_ = [fit_mapping([(x[:, own], y) for x, y in pairs], groups, s.regions,
                                      s.factors, s.ridge) for own in self._columns()]
        self.weights_, self.constant_ = self._worth(held)
        streams = train[0].measured[0].shape[1]
        errors = [(self._streams(e, streams) - targets)[valid]
                  for e, (targets, valid) in ((e, e.measured) for e in val)]
        self.variance_ = np.concatenate(errors).astype(np.float64).var(axis=0) + 1e-12

    def predict(self, example: Example) -> Prediction:
        """The smoothed trajectory with its derivatives; errors on the validation frames as variance.

        Mean streams are derivatives of one another, so parameter generation returns the trajectory
        as it stands.
        """
        mean = self._streams(example, len(self.variance_))
        return Prediction(mean, np.broadcast_to(self.variance_, mean.shape))

    def state(self) -> dict[str, Any]:
        """The mappings, what each is worth, and the error variance."""
        arrays = {"weights": self.weights_, "constant": self.constant_, "variance": self.variance_}
        return {"mappings": [mapping.state() for mapping in self.mappings_],
                **arrays}

    def load_state(self, state: dict[str, Any]) -> None:
        """Take over what :meth:`state` gave."""
        self.mappings_ = [AudioVisual.from_state(mapping) for mapping in state["mappings"]]
        self.weights_, self.constant_, self.variance_ = (
            state[name] for name in ("weights", "constant", "variance"))

    def _streams(self, example: Example, streams: int) -> np.ndarray:
        """The prediction (T, W, D)."""
        x = inputs(example.codes, self.places)
        static = self.constant_ + sum(w * y for w, y in zip(self.weights_, self._each(x), strict=True))
        if self.settings.cutoff is not None:
            static = smoothing_spline(static, self.clock, self.settings.cutoff)
        return derivatives(static, STATIC_DELTA_DELTA2.first(streams))

    def _each(self, x: np.ndarray) -> list[np.ndarray]:
        """What each mapping says (T, D) of rows (T, places x C)."""
        return [mapping(x[:, own]) for mapping, own in zip(self.mappings_, self._columns(), strict=True)]

    def _columns(self) -> list[np.ndarray]:
        """The columns of the rows that each mapping looks at."""
        width, places = self.table.width, len(self.places)
        if self.settings.blocks == "together":
            return [np.arange(width * places)]
        starts = width * np.arange(places)[:, None]
        return [(starts + np.arange(own.start, own.stop)).ravel() for own in self.table.slices.values()]

    def _pairs(self, examples: Sequence[Example]) -> Pairs:
        """Inputs and static targets of the measured frames of each utterance."""
        found = []
        for e in examples:
            targets, valid = e.measured
            found.append((inputs(e.codes, self.places)[valid], targets[valid, 0].astype(np.float64)))
        return found

    def _worth(self, held: Pairs) -> tuple[np.ndarray, np.ndarray]:
        """What each mapping counts for each parameter, (mappings, D), and a constant (D,).

        Of several mappings that sum of them, none negative, which is nearest to the validation frames.
        """
        if len(self.mappings_) == 1:
            return np.ones((1, held[0][1].shape[1])), np.zeros(held[0][1].shape[1])
        said = np.concatenate([np.stack(self._each(x), axis=1) for x, _ in held])
        seen = np.concatenate([y for _, y in held])
        centred, wanted = said - said.mean(axis=0), seen - seen.mean(axis=0)
        weights = np.stack([nnls(centred[:, :, d], wanted[:, d])[0] for d in range(seen.shape[1])], axis=1)
        return weights, seen.mean(axis=0) - (weights * said.mean(axis=0)).sum(axis=0)
