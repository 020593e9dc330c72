"""The baseline of the papers: hidden semi-Markov models of phones in context, their states tied by decision trees."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.features import FrameCodes, phones_of
from dnnvss.settings import check_settings, setting
from dnnvss.systems.base import Example, Prediction, VisualModel, pooled
from dnnvss.systems.hsmm_contexts import context_answers, context_questions
from dnnvss.systems.hsmm_durations import STATES, best_durations, equal_states
from dnnvss.systems.trees import Growth, Sums, Tree, grow

_CHUNK = 16384  # frames whose densities are worked out at once


@dataclass(frozen=True)
class HiddenSemiMarkovSettings:
    """How the trees grow, and how often states are aligned.

    Args:
        growth: of the trees of the states.
        duration_growth: of the tree of the durations.
    """

    growth: Growth = field(default_factory=Growth)
    duration_growth: Growth = field(default_factory=Growth)
    realignments: int = setting(1, least=0, doc="how often states are aligned anew inside the phone times")

    def __post_init__(self) -> None:
        check_settings(self, "model")


class HiddenSemiMarkov(VisualModel):
    """Five left-to-right states a phone, each a diagonal Gaussian over all streams, with Gaussian durations.

    One tree a state position, shared by all phones (which phone it is is among its questions), and one tree for the
    five durations. States start as equal fifths of the given phone times and are aligned anew, with the leaves of the
    trees that they led to, by an exact search over state durations (Viterbi training). Phones shorter than five frames
    leave states out.

    **Source**: Thangthai et al. 2016, section 5.2; Zen et al. 2007 for the model.

    Args:
        table: the feature table of the labels; its arrays answer the questions, whichever columns it selects.
        clock: the trajectory clock.
        settings: see :class:`HiddenSemiMarkovSettings`.
    """

    system = "hsmm"
    reads = frozenset({"phones", "words"})
    looks_up = frozenset({"phones"})
    Settings = HiddenSemiMarkovSettings
    settings: HiddenSemiMarkovSettings
    states_: list[Tree]
    durations_: Tree

    def fit(self, train: Sequence[Example], val: Sequence[Example], folder: Path) -> None:
        """Grow the trees on the training examples and print them to ``folder/trees.txt``; ``val`` is not needed.

        Raises:
            DnnvssError: no frame of the training examples was measured.
        """
        data = _Segments(train, self.lengths, self.answers)
        durations = equal_states(data.frames)
        for last in range(self.settings.realignments + 1):
            self._grow(data, durations)
            if last < self.settings.realignments:
                durations = self._aligned(data, durations)
        self.shape_ = data.shape
        self.states_ = [Tree(t.question, t.yes, t.no, t.leaf, t.count, t.mean * data.scale + data.centre,
                             t.variance * data.scale**2) for t in self.states_]
        few = [s for s, tree in enumerate(self.states_) if len(tree.leaf) == 1]
        self.notes_ = [f"state {s + 1}: too little data for a question, one Gaussian for all phones" for s in few]
        files.write_text(folder / "trees.txt", self.describe_trees() + "\n")

    def predict(self, example: Example) -> Prediction:
        """Return the means and variances of the leaves, frame by frame."""
        answers = self.answers(example.codes)
        durations = self.state_durations(example)
        leaves = np.stack([tree(answers) for tree in self.states_], 1)
        mean, variance = (np.stack([getattr(tree, name)[leaves[:, s]] for s, tree in enumerate(self.states_)], 1)
                          for name in ("mean", "variance"))
        shape = (-1, *self.shape_)
        times = durations.ravel()
        return Prediction(*(np.repeat(part.reshape(len(times), -1), times, 0).reshape(shape)
                            for part in (mean, variance)))

    def state_durations(self, example: Example) -> np.ndarray:
        """Return the frames (S, 5) of each state: the most probable ones that add up to the units' frames."""
        frames = self.lengths(example.codes)
        mean, variance = self._duration_gaussians(self.answers(example.codes))
        return _by_length(frames, lambda rows, n: best_durations(n, mean[rows], variance[rows]))

    def phone_durations(self, example: Example) -> np.ndarray | None:
        """Return the expected frames (S,) of each phone: the sum of its states' means."""
        return self._duration_gaussians(self.answers(example.codes))[0].sum(1)

    def lengths(self, codes: FrameCodes) -> np.ndarray:
        """The frames (S,) of the units whose states are modelled."""
        return phones_of(codes).frames

    def answers(self, codes: FrameCodes) -> np.ndarray:
        """Their answers (S, Q) to :meth:`questions`."""
        return context_answers(phones_of(codes))

    def questions(self) -> tuple[str, ...]:
        """What trees may ask of a unit, in words."""
        return context_questions()

    def asked_first(self) -> Sequence[int]:
        """The questions that every tree asks before all others."""
        return ()

    def describe_trees(self) -> str:
        """Return every tree as the questions that it asks, what was too little to ask last."""
        names = [f"state {s + 1}" for s in range(STATES)] + ["durations"]
        trees = [*self.states_, self.durations_]
        parts = [f"{name}: {len(tree.count)} leaves\n{tree.describe(self.questions())}"
                 for name, tree in zip(names, trees, strict=True)]
        return "\n\n".join([*parts, *self.notes_])

    def state(self) -> dict[str, Any]:
        """Return the trees and the questions whose answers they need."""
        return {"shape": list(self.shape_), "questions": list(self.questions()), "notes": list(self.notes_),
                "states": [tree.state() for tree in self.states_], "durations": self.durations_.state()}

    def load_state(self, state: dict[str, Any]) -> None:
        """Take over the trees.

        Raises:
            DnnvssError: they ask other questions than this version answers.
        """
        if list(state["questions"]) != list(self.questions()):
            raise DnnvssError("the decision trees ask other questions than this version answers",
                              remedy="Train the system anew")
        self.shape_, self.notes_ = tuple(state["shape"]), list(state["notes"])
        self.states_ = [Tree.from_state(tree) for tree in state["states"]]
        self.durations_ = Tree.from_state(state["durations"])

    def _duration_gaussians(self, answers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        leaf = self.durations_(answers)
        return self.durations_.mean[leaf], self.durations_.variance[leaf] + 1e-2

    def _grow(self, data: "_Segments", durations: np.ndarray) -> None:
        first = self.asked_first()
        self.states_ = [grow(data.answers, data.sums(durations, s), self.settings.growth, first)
                        for s in range(STATES)]
        whole = data.complete
        lasting = durations[whole].astype(np.float64)
        self.durations_ = grow(data.answers[whole], Sums(np.ones(len(lasting)), lasting, lasting**2),
                               self.settings.duration_growth, first)

    def _aligned(self, data: "_Segments", durations: np.ndarray) -> np.ndarray:
        """Return durations (S, 5) realigned to the frames; phones with unmeasured frames keep theirs."""
        density = data.densities(self.states_)
        mean, variance = self._duration_gaussians(data.answers)

        def search(rows: np.ndarray, frames: int) -> np.ndarray:
            places = data.start[rows, None] + np.arange(frames)
            return best_durations(frames, mean[rows], variance[rows], density[places])

        realigned = _by_length(data.frames, search)
        return np.where(data.complete[:, None], realigned, durations)


class _Segments:
    """All units of the examples that own a frame, and their frames, normalised, one after the other."""

    def __init__(self, examples: Sequence[Example], lengths: Callable[[FrameCodes], np.ndarray],
                 answers: Callable[[FrameCodes], np.ndarray]) -> None:
        frames = pooled(examples)
        if not len(frames):
            raise DnnvssError("no frame of the training examples was measured", remedy="Train on measured utterances")
        self.shape = frames.shape[1:]
        flat = frames.reshape(len(frames), -1)
        self.centre = flat.mean(0, dtype=np.float64)
        self.scale = np.maximum(flat.std(0, dtype=np.float64), 1e-8)
        whole = np.concatenate([e.measured[0] for e in examples]).reshape(-1, flat.shape[1])
        self.valid = np.concatenate([e.measured[1] for e in examples])
        self.values = np.where(self.valid[:, None], (whole - self.centre) / self.scale, 0).astype(np.float32)
        frames_of = np.concatenate([lengths(e.codes) for e in examples])
        kept = frames_of > 0
        self.frames = frames_of[kept]
        self.start = np.cumsum(self.frames) - self.frames
        self.answers = np.concatenate([answers(e.codes) for e in examples])[kept]
        self.complete = np.add.reduceat(~self.valid, self.start) == 0

    def sums(self, durations: np.ndarray, state: int) -> Sums:
        """Return the statistics of the frames in one state of each phone."""
        first = self.start + durations[:, :state].sum(1)
        some = np.flatnonzero(durations[:, state])
        lasting = durations[some, state]
        places = np.repeat(first[some] - (np.cumsum(lasting) - lasting), lasting) + np.arange(lasting.sum())
        count = np.zeros(len(durations))
        total, squares = (np.zeros((len(durations), self.values.shape[1]), dtype=np.float32) for _ in range(2))
        if len(some):
            values, edges = self.values[places], np.cumsum(lasting) - lasting
            count[some] = np.add.reduceat(self.valid[places].astype(float), edges)
            total[some], squares[some] = np.add.reduceat(values, edges), np.add.reduceat(values**2, edges)
        return Sums(count, total, squares)

    def densities(self, trees: Sequence[Tree]) -> np.ndarray:
        """Return the log density (frames, 5) of each frame in each state of its phone."""
        owner = np.repeat(np.arange(len(self.frames)), self.frames)
        out = np.empty((len(self.values), len(trees)))
        for s, tree in enumerate(trees):
            leaf = tree(self.answers)[owner]
            mean, precision = tree.mean.astype(np.float32), (1 / tree.variance).astype(np.float32)
            constant = np.log(tree.variance).sum(1)
            for low in range(0, len(owner), _CHUNK):
                part = slice(low, low + _CHUNK)
                spread = (self.values[part] - mean[leaf[part]]) ** 2
                out[part, s] = -0.5 * (np.einsum("fk,fk->f", spread, precision[leaf[part]]) + constant[leaf[part]])
        return out


def _by_length(frames: np.ndarray, search: Any) -> np.ndarray:
    """Return durations (S, 5) by calling ``search(rows, frames)`` once for all phones of a length."""
    durations = np.zeros((len(frames), STATES), dtype=np.int64)
    for length in np.unique(frames[frames > 0]):
        rows = np.flatnonzero(frames == length)
        durations[rows] = search(rows, int(length))
    return durations
