"""Real segments of the recordings, of one length whatever is said, chosen by the trajectory of another system."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss.curves import STATIC_DELTA_DELTA2, derivatives
from dnnvss.errors import DnnvssError
from dnnvss.face.base import Face
from dnnvss.features import FeatureTable
from dnnvss.settings import check_settings, setting
from dnnvss.systems.base import READABLE, Example, Prediction, VisualModel
from dnnvss.systems.cheapest import cheapest_path
from dnnvss.systems.guide import check_guide, make_guide, stretch_of
from dnnvss.timing import FrameClock

_SAMPLES = 5
"""Points of a segment at which it is compared with the guide."""


@dataclass(frozen=True)
class SegmentSettings:
    """The settings of :class:`GuidedSegments`.

    Raises:
        DnnvssError: a value out of range, or a guide that is no system.
    """

    guide: Mapping[str, Any] = setting({"system": "cca"}, doc="the system that leads, as a file of conf/model says it")
    length: float = setting(0.24, above=0, doc="seconds of a segment; neighbours overlap by half")
    every: float = setting(0.03, above=0, doc="seconds from the start of one recorded segment to that of the next")
    candidates: int = setting(40, least=1, doc="nearest segments that the search weighs")
    join: float = setting(0.5, least=0, doc="weight of the difference of neighbours where they overlap")

    def __post_init__(self) -> None:
        check_settings(self, "model")
        check_guide(self.guide)


class GuidedSegments(VisualModel):
    """Recorded segments near a guide's trajectory that agree where they overlap, faded into each other.

    The guide is stretched about its mean to the talker's deviation. A segment costs the mean squared distance from it
    at five points, and neighbours the mean squared difference where they overlap; dynamic programming over the nearest
    ``candidates`` of each place finds the least sum. Nothing but the guide says what is wanted: led by a system that
    hears the voice alone, it needs neither words nor times.

    **Source**: Theobald and Wilkinson 2007, section 5, who suggest that the predicted trajectory indexes the training
    data and real segments are taken; length, costs and fades are ours.

    Args:
        table: the feature table of the labels.
        clock: the trajectory clock.
        settings: see :class:`SegmentSettings`.
    """

    system = "segments"
    reads = READABLE
    Settings = SegmentSettings
    settings: SegmentSettings

    def __init__(self, table: FeatureTable, clock: FrameClock, settings: SegmentSettings | None = None) -> None:
        super().__init__(table, clock, settings)
        s, rate = self.settings, float(clock.rate)
        self.leader = make_guide(s.guide, table, clock)
        self.half = max(1, round(s.length * rate / 2))
        self.every = max(1, round(s.every * rate))

    def take_face(self, face: Face) -> None:
        """Tell the guide."""
        self.leader.take_face(face)

    def fit(self, train: Sequence[Example], val: Sequence[Example], folder: Path) -> None:
        """Fit the guide and keep the training trajectories.

        Raises:
            DnnvssError: no stretch of the training was measured for as long as a segment.
        """
        self.leader.fit(train, val, folder / "guide")
        self.centre_, self.stretch_ = stretch_of(self.leader, val)
        measured = [e.measured for e in train]
        self.static_ = np.concatenate([targets[:, 0] for targets, _ in measured]).astype(np.float32)
        ends = np.cumsum([len(valid) for _, valid in measured])
        starts = [end - len(valid) + self._starts(valid) for end, (_, valid) in zip(ends, measured, strict=True)]
        self.starts_ = np.concatenate(starts)
        if not len(self.starts_):
            raise DnnvssError(f"no {self.settings.length:g} s of the training were measured in one piece",
                              remedy="Give a shorter model.length")
        self.variance_ = 0.01 * np.concatenate([t[v] for t, v in measured]).var(axis=0, dtype=np.float64) + 1e-12
        self._index()

    def predict(self, example: Example) -> Prediction:
        """The faded segments and their derivatives; the variance is a hundredth of the training frames'."""
        static = self.faded(self.chosen(self._guide(example)), len(example.codes))
        mean = derivatives(static, STATIC_DELTA_DELTA2.first(len(self.variance_)))
        return Prediction(mean, np.broadcast_to(self.variance_, mean.shape))

    def chosen(self, guide: np.ndarray) -> list[int]:
        """The first frames, among all training frames, of the segments for a guide (T, D): one every half segment."""
        rows = self.nearest(np.stack(self._pieces(guide))[:, self._places])

        def joins() -> Iterator[np.ndarray]:
            for (before, _), (entries, _) in pairwise(rows):
                behind = self._frames(before + self.half, self.half).reshape(len(before), -1)
                ahead = self._frames(entries, self.half).reshape(len(entries), -1)
                gaps = ((behind**2).sum(axis=1)[:, None] + (ahead**2).sum(axis=1) - 2 * behind @ ahead.T) / self.half
                yield self.settings.join * np.maximum(gaps, 0)

        path = cheapest_path([costs for _, costs in rows], joins())
        return [int(entries[k]) for (entries, _), k in zip(rows, path, strict=True)]

    def faded(self, starts: Sequence[int], frames: int) -> np.ndarray:
        """Segments (T, D), each risen and fallen over half its length; the first begins half a segment early."""
        fade = np.sin(np.pi * (np.arange(2 * self.half) + 0.5) / (2 * self.half))[:, None] ** 2
        out = np.zeros(((len(starts) + 1) * self.half, self.static_.shape[1]))
        for k, start in enumerate(starts):
            out[k * self.half : (k + 2) * self.half] += fade * self.static_[start : start + 2 * self.half]
        return out[self.half : self.half + frames]

    def state(self) -> dict[str, Any]:
        """The guide, how it is stretched, and the trajectories with the places of segments."""
        arrays = {"static": self.static_, "starts": self.starts_, "centre": self.centre_, "stretch": self.stretch_,
                  "variance": self.variance_}
        return {"guide": self.leader.state(), **arrays}

    def load_state(self, state: dict[str, Any]) -> None:
        """Take over what :meth:`state` gave."""
        self.leader.load_state(state["guide"])
        self.static_, self.starts_, self.centre_, self.stretch_, self.variance_ = (
            state[name] for name in ("static", "starts", "centre", "stretch", "variance"))
        self._index()

    def _guide(self, example: Example) -> np.ndarray:
        return (self.leader.predict(example).mean[:, 0] - self.centre_) * self.stretch_ + self.centre_

    def _starts(self, valid: np.ndarray) -> np.ndarray:
        """The frames of an utterance where a segment begins that was measured throughout."""
        sums = np.concatenate([[0], np.cumsum(valid)])
        starts = np.arange(0, len(valid) - 2 * self.half + 1, self.every)
        return starts[sums[starts + 2 * self.half] - sums[starts] == 2 * self.half]

    def _pieces(self, guide: np.ndarray) -> list[np.ndarray]:
        """The guide (T, D) where each segment will lie, (2 half, D); its ends are held."""
        count = -(-len(guide) // self.half) + 1
        index = np.clip(np.arange((count + 1) * self.half) - self.half, 0, len(guide) - 1)
        held = guide[index]
        return [held[k * self.half : (k + 2) * self.half] for k in range(count)]

    @property
    def _places(self) -> np.ndarray:
        """The frames of a segment at which it is compared."""
        return np.round(np.linspace(0, 2 * self.half - 1, _SAMPLES)).astype(int)

    def nearest(self, wanted: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """For each piece of a guide, the first frames (n,) of the nearest recorded segments, and their costs (n,).

        Args:
            wanted: the pieces at five points, (pieces, 5, D).
        """
        flat = wanted.reshape(len(wanted), -1).astype(np.float32)
        rough = (self._samples**2).sum(axis=1)[:, None] - 2 * self._samples @ flat.T
        count = min(self.settings.candidates, len(rough))
        found = []
        for k, near in enumerate(np.argpartition(rough, count - 1, axis=0)[:count].T):
            costs = ((self._samples[near].astype(np.float64) - wanted[k].ravel()) ** 2).sum(axis=1) / _SAMPLES
            best = np.lexsort((near, costs))
            found.append((self.starts_[near[best]], costs[best]))
        return found

    def _index(self) -> None:
        """Sample every recorded segment at its five points, float32 (n, 5 D)."""
        self._samples = self.static_[self.starts_[:, None] + self._places].reshape(len(self.starts_), -1)

    def _frames(self, starts: np.ndarray, count: int) -> np.ndarray:
        """The trajectory (n, count, D) from each of some frames on."""
        return self.static_[starts[:, None] + np.arange(count)].astype(np.float64)
