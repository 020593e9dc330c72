"""Kernel regression on the phones around a frame: for a talker of whom there are minutes or less."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter1d

from dnnvss.curves import STATIC_DELTA_DELTA2, derivatives
from dnnvss.errors import DnnvssError
from dnnvss.features import phones_of
from dnnvss.phones import PHONES
from dnnvss.phones.articulation import ARTICULATION, Articulation
from dnnvss.settings import check_settings, setting
from dnnvss.systems.base import Example, Prediction, VisualModel

_SEEN = 500
"""Frames from which the typical distance is measured."""
_AT_ONCE = 2000
"""Frames whose distances are worked out at once: bounds memory on long text."""


@dataclass(frozen=True)
class KernelSettings:
    """What a kernel regression sees, and how smooth it is."""

    places: tuple[float, ...] = setting((-0.24, -0.12, -0.05, 0, 0.05, 0.12, 0.24), least=-2, most=2,
                                        doc="seconds from the frame at which phones are looked at")
    spreads: tuple[float, ...] = setting((0.08, 0.05, 0.03, 0.02, 0.03, 0.05, 0.08), above=0, most=1,
                                         doc="deviation in seconds of the window at each place")
    weights: tuple[float, ...] = setting((0.5, 0.7, 1, 1.2, 1, 0.7, 0.5), above=0, doc="of each place")
    identity: float = setting(0.7, least=0, doc="weight of which phone it is")
    articulation: float = setting(0.7, least=0, doc="weight of how it is made: what phones never heard are known by")
    width: float = setting(0.7, above=0, doc="of the kernel, in units of the typical distance of two frames")
    noise: float = setting(0.3, above=0, doc="variance that is no speech, as a share of what the kernel explains")
    rate: float = setting(33, above=0, doc="frames a second that are learnt from: neighbours say the same")
    most: int = setting(2500, least=2, doc="frames that are learnt from at most, evenly spread")

    def __post_init__(self) -> None:
        check_settings(self, "model")
        if not len(self.places) == len(self.spreads) == len(self.weights) > 0:
            raise DnnvssError(f"model.places, spreads and weights have {len(self.places)}, {len(self.spreads)} and "
                              f"{len(self.weights)} values", remedy="Give one of each for every place")


class KernelRegression(VisualModel):
    """The expectation of a Gaussian process over what is said around a frame.

    A frame is seen as the phones at some places before and behind it, each place a Gaussian window in time and each
    phone as what it is and as how it is made (manner, place, lips, opening of the jaw). Frames that look alike to that
    eye have like parameters: with ``x`` what is seen, ``k(x, x') = exp(-|x - x'|^2 / (2 w^2))`` and ``y`` the measured
    parameters less their mean, the prediction is ``mean + k(x, X) (k(X, X) + noise I)^-1 y``. It says the mean where
    nothing like it was heard, and cannot learn a corpus by heart.

    **Source**: Rasmussen and Williams, Gaussian processes for machine learning (2006), section 2.2; what is seen is
    ours.

    Args:
        table: the feature table of the labels; its columns are not used.
        clock: the trajectory clock.
        settings: see :class:`KernelSettings`.
    """

    system = "kernel"
    reads = frozenset({"phones"})
    looks_up = frozenset({"phones"})
    Settings = KernelSettings
    settings: KernelSettings

    def fit(self, train: Sequence[Example], val: Sequence[Example], folder: Path) -> None:
        """Solve for the weights of the training frames; ``val`` gives the variance of the errors.

        Raises:
            DnnvssError: no frame of the training examples was measured.
        """
        step = max(1, round(float(self.clock.rate) / self.settings.rate))
        drawn = [(e, np.flatnonzero(e.measured[1])[::step]) for e in train]
        total = sum(len(frames) for _, frames in drawn)
        if not total:
            raise DnnvssError("no frame of the training examples was measured", remedy="Train on measured utterances")
        thinner = -(-total // self.settings.most)
        seen = np.concatenate([self.seen(e)[frames] for e, frames in drawn])[::thinner]
        values = np.concatenate([e.measured[0][frames, 0] for e, frames in drawn])[::thinner].astype(np.float64)
        self.seen_, self.mean_ = seen.astype(np.float32), values.mean(0)
        self._measure(seen)
        kernel = self._kernel(self.seen_)
        kernel[np.diag_indices_from(kernel)] += self.settings.noise
        self.weights_ = np.linalg.solve(kernel, values - self.mean_)
        self.windows_ = STATIC_DELTA_DELTA2.first(train[0].measured[0].shape[1])
        self.variance_ = error_variance(self.streams, val or train)

    def _measure(self, seen: np.ndarray) -> None:
        """Take the width of the kernel from what is seen (N, columns) of training frames."""
        self.width_ = self.settings.width * typical_distance(seen)

    def predict(self, example: Example) -> Prediction:
        """Return the expected trajectory and its derivatives, with the error variance on the validation frames."""
        mean = self.streams(example)
        return Prediction(mean, np.broadcast_to(self.variance_, mean.shape))

    def streams(self, example: Example) -> np.ndarray:
        """The expected trajectory with its derivatives, (T, W, D)."""
        seen = self.seen(example)
        parts = [self._kernel(seen[k : k + _AT_ONCE]) @ self.weights_ for k in range(0, len(seen), _AT_ONCE)]
        return derivatives(self.mean_ + np.concatenate(parts), self.windows_)

    def seen(self, example: Example) -> np.ndarray:
        """What is seen of each frame, (T, places x columns of a phone)."""
        s, rate = self.settings, float(self.clock.rate)
        phones = phones_of(example.codes)
        said = described(s.identity, s.articulation)[np.repeat(phones.code, phones.frames)]
        frames = np.arange(len(said))
        parts = [weight * gaussian_filter1d(said, spread * rate, axis=0, mode="nearest")[
                     np.clip(frames + round(place * rate), 0, len(said) - 1)]
                 for place, spread, weight in zip(s.places, s.spreads, s.weights, strict=True)]
        return np.concatenate(parts, axis=1)

    def state(self) -> dict[str, Any]:
        """Return what was seen of the training frames, their weights, mean, variance and the kernel's width."""
        arrays = {"seen": self.seen_, "weights": self.weights_, "mean": self.mean_, "variance": self.variance_}
        return {"width": self.width_} | arrays

    def load_state(self, state: dict[str, Any]) -> None:
        """Take over what was learnt."""
        self.width_ = float(state["width"])
        self.seen_, self.weights_, self.mean_, self.variance_ = (
            state[name] for name in ("seen", "weights", "mean", "variance"))
        self.windows_ = STATIC_DELTA_DELTA2.first(len(self.variance_))

    def _kernel(self, seen: np.ndarray) -> np.ndarray:
        return np.exp(squared_distances(seen, self.seen_) / (-2 * self.width_**2))


def squared_distances(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The squared distances (N, M) of rows (N, columns) and (M, columns), by one matrix product."""
    a, b = a.astype(float), b.astype(float)
    apart = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2 * (a @ b.T)
    return np.asarray(np.maximum(apart, 0.0, out=apart))


def typical_distance(seen: np.ndarray) -> float:
    """The median distance of two frames among some of (N, columns); 1 where all look alike.

    Of recordings that are mostly silence most frames look alike: then the median is that of those that do not.
    """
    from scipy.spatial.distance import pdist  # slow to import, and asked by a fit alone

    apart = pdist(seen[:: -(-len(seen) // _SEEN)])
    if not apart.any():
        return 1.0
    return float(np.median(apart)) or float(np.median(apart[apart > 0]))


def error_variance(streams: Any, examples: Sequence[Example]) -> np.ndarray:
    """The variance (W, D) of the errors of predicted streams over the measured frames of examples.

    Args:
        streams: example to (T, W, D).
        examples: measured ones.
    """
    measured = ((e, *e.measured) for e in examples)
    known = [((streams(e) - targets)[valid], targets[valid]) for e, targets, valid in measured]
    errors, targets = (np.concatenate(part).astype(np.float64) for part in zip(*known, strict=True))
    return errors.var(0) + 1e-6 * targets.var(0) + 1e-12


@cache
def described(identity: float, articulation: float) -> np.ndarray:
    """Each phone as a row (41, columns): which one it is, and how it is made, with their weights."""
    made = [ARTICULATION[phone] for phone in PHONES]
    kinds = [sorted({str(getattr(a, name)) for a in made} - {""}) for name in _NAMED]
    rows = [[*(str(getattr(a, name)) == kind for name, own in zip(_NAMED, kinds, strict=True) for kind in own),
             *_amounts(a)] for a in made]
    return np.concatenate([identity * np.eye(len(PHONES)), articulation * np.array(rows, float)], axis=1)


_NAMED = ("manner", "place", "lips", "glide")


def _amounts(a: Articulation) -> list[float]:
    """What is more or less: the opening of the jaw counts twice, for that is what is seen most."""
    return [2 * a.opening, a.voiced, a.tense, a.rhotic, a.lateral]
