"""Real pieces of the recordings, chosen by the trajectory that a network or any other system predicts."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.base import Face
from dnnvss.features import FeatureTable, phones_of
from dnnvss.phones import PHONES
from dnnvss.settings import setting
from dnnvss.systems.base import READABLE, Example, Prediction, VisualModel
from dnnvss.systems.cheapest import cheapest_path
from dnnvss.systems.codebook import Choice, Codebook, CodebookSettings
from dnnvss.systems.codebook_units import SAMPLES
from dnnvss.systems.guide import check_guide, make_guide, opened_guide, stretch_of
from dnnvss.systems.members import MembersSettings, NetworkSettings
from dnnvss.systems.plain_network import PlainNetwork
from dnnvss.timing import FrameClock


@dataclass(frozen=True)
class GuidedSettings(MembersSettings):
    """The settings of :class:`GuidedCodebook`.

    Raises:
        DnnvssError: a value out of range, or more examples than candidates.
    """

    candidates: int = setting(150, least=1, doc="examples of a phone that the search weighs")
    examples: int = setting(3, least=1, doc="how many of them are averaged; 1 plays a single recording")
    join: float = setting(0.03, least=0, doc="weight of the join costs")
    cutoff: float | None = setting(15.0, above=0, doc="Hz of the codebook's smoothing spline")
    guide: Mapping[str, Any] | None = setting(None, doc="the system that leads, as a file of conf/model says it; the "
                                                        "network where null")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.guide is not None:
            check_guide(self.guide)
        if self.examples > self.candidates:
            raise DnnvssError(f"model.candidates={self.candidates} is less than model.examples={self.examples}",
                              remedy="Give as many candidates as examples, or more")


class GuidedCodebook(VisualModel):
    """Recorded examples for each phone: near a guide's trajectory, and fitting their neighbours.

    The guide is a network, or any system that reads the labels. It moves less than the talker; its trajectory is first
    stretched about its mean to the deviation that the validation frames have. The target cost of an example is the mean
    squared distance of that guide from it at five equidistant points of the phone; the join cost of two examples is the
    squared distance between the end of the first and the start of the second. Both are summed over parameters as they
    are, so that each counts by its significance.
    The sequence of the least total cost is found by dynamic programming over the ``candidates`` nearest examples of
    each phone. Beside the one on that path stand those that would cost least in its place; ``examples`` of them are
    averaged, which takes chance out and, since all are near one guide, little movement. What is left of the jumps is
    laid on straight ramps over half of each piece.

    **Source**: Theobald and Wilkinson 2007, who suggest the choice; the costs are ours.

    Args:
        table: the feature table of the labels.
        clock: the trajectory clock.
        settings: see :class:`GuidedSettings`.

    Raises:
        DnnvssError: what :class:`NetworkModel` refuses.
    """

    system = "guided"
    reads = READABLE
    looks_up = frozenset({"phones"})
    Settings = GuidedSettings
    settings: GuidedSettings

    def __init__(self, table: FeatureTable, clock: FrameClock, settings: GuidedSettings | None = None) -> None:
        super().__init__(table, clock, settings)
        s = self.settings
        self.candidates, self.examples, self.join = s.candidates, s.examples, s.join
        self.book = Codebook(table, clock, CodebookSettings(examples=1, cutoff=s.cutoff))

    def take_face(self, face: Face) -> None:
        """Tell the guide."""
        self.leader.take_face(face)

    def fit(self, train: Sequence[Example], val: Sequence[Example], folder: Path) -> None:
        """Fit the guide and keep the training trajectories."""
        if isinstance(self.leader, PlainNetwork):  # as it was opened; it learns no more
            self.leader = self._leader()
        self.leader.fit(train, val, folder / "network")
        self.book.fit(train, val, folder)
        self.centre_, self.stretch_ = stretch_of(self.leader, val)
        self._index()

    def predict(self, example: Example) -> Prediction:
        """Return the joined pieces and their derivatives; the variance is the codebook's."""
        choices = self.choices(example)
        frames = phones_of(example.codes).frames
        ends = np.stack([self._samples[list(c.entries)].mean(axis=0, dtype=np.float64) for c in choices])
        joined = _ramped(self.book.joined(example, choices), ends[1:, 0] - ends[:-1, -1], frames[frames > 0])
        mean = self.book.streams(self.book.smoothed(joined))
        return Prediction(mean, np.broadcast_to(0.01 * self.book.variance_, mean.shape))

    def choices(self, example: Example) -> list[Choice]:
        """Return the selection report: the examples that each phone with a frame is made of."""
        guide = (self.leader.predict(example).mean[:, 0] - self.centre_) * self.stretch_ + self.centre_
        wanted = _sampled(guide, example)
        rows = [self._nearest(code, points) for code, points in wanted]
        path = self._path(rows)
        return [self._choice(code, self._cheapest(rows[k], path, k)) for k, (code, _) in enumerate(wanted)]

    def report(self, example: Example) -> dict[str, Any]:
        """Return which sentence each phone came from."""
        return {"selection": [c.described() for c in self.choices(example)]}

    def state(self) -> dict[str, Any]:
        """Return the states of the guide and of the codebook, and how the guide's trajectory is stretched."""
        return {"guide": self.leader.state(), "book": self.book.state(),
                "centre": self.centre_, "stretch": self.stretch_}

    def load_state(self, state: dict[str, Any]) -> None:
        """Take over the states of the guide and of the codebook."""
        own = self.settings
        described = own.guide or {"system": "network", "network": own.network}
        self.leader = opened_guide(described, self._leader, self.table, self.clock, state["guide"])
        self.book.load_state(state["book"])
        self.centre_, self.stretch_ = state["centre"], state["stretch"]
        self._index()

    @cached_property
    def leader(self) -> VisualModel:
        """The guide, untrained where none was fitted or opened."""
        return self._leader()

    def _leader(self) -> VisualModel:
        """The untrained guide, with the face that is to be shown."""
        s = self.settings
        if s.guide is None:
            from dnnvss.systems.network import NetworkModel  # loads torch

            leader: VisualModel = NetworkModel(self.table, self.clock, NetworkSettings(s.network, s.fit, s.members))
        else:
            leader = make_guide(s.guide, self.table, self.clock, s.fit)
        if self.face is not None:
            leader.shown_on(self.face)
        return leader

    def _index(self) -> None:
        """Sample every example at five points, from its first moment to its last: (P, 5, D)."""
        corpus = self.book.corpus_
        places = corpus.first[:, None] - 0.5 + corpus.frames[:, None] * np.linspace(0, 1, SAMPLES)
        self._samples = corpus.at(places, np.repeat(corpus.owner[:, None], SAMPLES, 1)).astype(np.float32)

    def _nearest(self, code: int, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the nearest examples (n,) of a phone to a guide sampled at five points (5, D), and their costs."""
        entries = self.book.entries(code)
        costs = ((self._samples[entries] - wanted) ** 2).mean(axis=1).sum(axis=1)
        best = np.argsort(costs, kind="stable")[: self.candidates]
        return entries[best], costs[best]

    def _path(self, rows: Sequence[tuple[np.ndarray, np.ndarray]]) -> list[int]:
        """Return the examples of the least total cost, one of each row."""
        def joins() -> Iterator[np.ndarray]:
            for (before, _), (entries, _) in pairwise(rows):
                ends, starts = self._samples[before, -1], self._samples[entries, 0]
                yield self.join * ((ends**2).sum(axis=1)[:, None] + (starts**2).sum(axis=1) - 2 * ends @ starts.T)

        path = cheapest_path([costs for _, costs in rows], joins())
        return [int(entries[k]) for (entries, _), k in zip(rows, path, strict=True)]

    def _cheapest(self, row: tuple[np.ndarray, np.ndarray], path: Sequence[int], k: int) -> np.ndarray:
        """Return the examples (n,) that cost least in place ``k`` of a path, its own first."""
        entries, costs = row
        costs = costs.astype(np.float64)
        if k > 0:
            costs += self.join * ((self._samples[path[k - 1], -1] - self._samples[entries, 0]) ** 2).sum(axis=1)
        if k + 1 < len(path):
            costs += self.join * ((self._samples[entries, -1] - self._samples[path[k + 1], 0]) ** 2).sum(axis=1)
        costs[entries == path[k]] = -np.inf
        return entries[np.argsort(costs, kind="stable")[: self.examples]]

    def _choice(self, code: int, entries: np.ndarray) -> Choice:
        corpus, share = self.book.corpus_, 1 / len(entries)
        return Choice(PHONES[code], PHONES[int(corpus.code[entries[0]])], tuple(entries.tolist()),
                      (share,) * len(entries), tuple(corpus.ids[u] for u in corpus.owner[entries]))


def _ramped(static: np.ndarray, jumps: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Return joined pieces (T, D) whose jumps are laid on ramps over half of the piece on either side.

    Args:
        static: the pieces one after the other.
        jumps: (pieces - 1, D), by how much each piece starts above the end of the one before it.
        frames: (pieces,) how long each is.
    """
    edges = np.cumsum([0, *frames])
    out = static.copy()
    for k, jump in enumerate(jumps, start=1):
        for piece, sign in ((k - 1, 0.5), (k, -0.5)):
            away = np.abs(np.arange(edges[piece], edges[piece + 1]) + 0.5 - edges[k])
            share = sign * np.maximum(0, 1 - 2 * away / frames[piece])
            out[edges[piece] : edges[piece + 1]] += share[:, None] * jump
    return out


def _sampled(guide: np.ndarray, example: Example) -> list[tuple[int, np.ndarray]]:
    """Return the code of each phone that has a frame, and the guide (T, D) at its five points (5, D)."""
    phones = phones_of(example.codes)
    frames = np.arange(len(guide)) + 0.5
    out = []
    for code, start, count in zip(phones.code, phones.start, phones.frames, strict=True):
        if count:
            places = start + count * np.linspace(0, 1, SAMPLES)
            out.append((int(code), np.stack([np.interp(places, frames, x) for x in guide.T], axis=1)))
    return out
