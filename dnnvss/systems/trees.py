"""Decision trees whose leaves are diagonal Gaussians, grown on sums, stopped by description length or leaf size."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dnnvss.settings import setting

_FIELDS = ("question", "yes", "no", "leaf", "count", "mean", "variance")


@dataclass(frozen=True)
class Sums:
    """Sufficient statistics of S rows: ``count`` (S,), ``total`` (S, K) of values and ``squares`` (S, K) of squares."""

    count: np.ndarray
    total: np.ndarray
    squares: np.ndarray

    def pooled(self) -> tuple[float, np.ndarray, np.ndarray]:
        """Return count, mean (K,) and variance (K,) over all rows, float64."""
        count = float(self.count.sum(dtype=np.float64))
        mean = self.total.sum(0, dtype=np.float64) / max(count, 1e-300)
        return count, mean, np.maximum(self.squares.sum(0, dtype=np.float64) / max(count, 1e-300) - mean**2, 0)


@dataclass(frozen=True)
class Growth:
    """When a tree stops growing, and the least variance of a leaf.

    Args:
        mdl: share of the description length that a split has to repay: it must raise the log likelihood by more than
            ``mdl * K * ln(values at the root)``, K means and K variances being added (**Source**: Shinoda and Watanabe
            2000, section 3). None stops by leaf size alone.
        least_rows: rows (phones) that a leaf keeps at least.
        least_count: values (frames) that a leaf keeps at least.
        floor: least variance of a leaf as a share of the variance at the root.
    """

    mdl: float | None = setting(1.0, least=0)
    least_rows: int = setting(2, least=1)
    least_count: float = setting(2.0, least=0)
    floor: float = setting(1e-3, above=0)


@dataclass(frozen=True)
class Tree:
    """A binary tree over N nodes, node 0 its root, with Gaussians of K values at its leaves.

    Args:
        question: (N,) index of the question that a node asks, -1 at a leaf.
        yes, no: (N,) the nodes that follow.
        leaf: (N,) index of a leaf, -1 at other nodes.
        count: (leaves,) values seen.
        mean, variance: (leaves, K).
    """

    question: np.ndarray
    yes: np.ndarray
    no: np.ndarray
    leaf: np.ndarray
    count: np.ndarray
    mean: np.ndarray
    variance: np.ndarray

    def __call__(self, answers: np.ndarray) -> np.ndarray:
        """Return the leaf (S,) of each row of answers (S, Q)."""
        node = np.zeros(len(answers), dtype=np.int64)
        rows = np.flatnonzero(self.question[node] >= 0)
        while len(rows):
            at = node[rows]
            asked = answers[rows, self.question[at]].astype(bool)
            node[rows] = np.where(asked, self.yes[at], self.no[at])
            rows = rows[self.question[node[rows]] >= 0]
        return self.leaf[node]

    def describe(self, questions: Sequence[str]) -> str:
        """Return the tree in words, a line a node, what follows a yes first."""
        return "\n".join(self._lines(questions))

    def _lines(self, questions: Sequence[str]) -> Iterator[str]:
        stack = [(0, "", "")]
        while stack:
            node, indent, answer = stack.pop()
            if (asked := int(self.question[node])) < 0:
                leaf = int(self.leaf[node])
                yield f"{indent}{answer}leaf {leaf}, {self.count[leaf]:g} values"
            else:
                yield f"{indent}{answer}{questions[asked]}"
                stack += [(int(self.no[node]), indent + "  ", "no:  "), (int(self.yes[node]), indent + "  ", "yes: ")]

    def state(self) -> dict[str, Any]:
        """Return the arrays by name."""
        return {name: getattr(self, name) for name in _FIELDS}

    @classmethod
    def from_state(cls, state: dict[str, Any]) -> "Tree":
        """Return the tree that :meth:`state` described."""
        return cls(**{name: state[name] for name in _FIELDS})


def grow(answers: np.ndarray, sums: Sums, growth: Growth, first: Sequence[int] = ()) -> Tree:
    """Return the tree that splits rows by the question that raises their likelihood most, until none is worth it.

    Too little data for any split leaves a tree of one leaf; no data at all, a leaf with mean 0 and variance 1.

    Args:
        answers: (S, Q) yes or no of each row to each question.
        sums: statistics of the rows.
        growth: when to stop.
        first: questions that are asked before all others, one after the other as long as the answer is no, whatever
            they gain; those that all rows of a node answer alike are left out.
    """
    kept = np.flatnonzero(sums.count > 0)
    builder = _Builder(answers[kept].astype(np.float32),
                       Sums(sums.count[kept], sums.total[kept], sums.squares[kept]), growth)
    return builder.build(list(first))


class _Builder:
    """Grows one tree; rows are kept as index arrays, statistics of all questions of a node come from one product."""

    def __init__(self, answers: np.ndarray, sums: Sums, growth: Growth) -> None:
        self.answers, self.sums, self.growth = answers, sums, growth
        self.stacked = np.concatenate([sums.count[:, None], sums.total, sums.squares], 1).astype(np.float32)
        self.count, self.root_mean, variance = sums.pooled()
        self.floor = np.maximum(growth.floor * variance, 1e-12)
        self.price = 0.0
        if growth.mdl is not None and self.count > 1:
            self.price = growth.mdl * sums.total.shape[1] * np.log(self.count)
        self.nodes: list[list[int]] = []
        self.leaves: list[tuple[float, np.ndarray, np.ndarray]] = []

    def build(self, first: list[int]) -> Tree:
        stack: list[tuple[np.ndarray, int, int, list[int]]] = [(np.arange(len(self.answers)), -1, 0, first)]
        while stack:
            rows, parent, side, asked_first = stack.pop()
            node = len(self.nodes)
            if parent >= 0:
                self.nodes[parent][side] = node
            asked_first = self.telling(rows, asked_first)
            question = asked_first[0] if asked_first else self.best_question(rows)
            self.nodes.append([question, -1, -1, -1])
            if question < 0:
                self.nodes[node][3] = len(self.leaves)
                self.leaves.append(self.gaussian(rows))
            else:
                yes = self.answers[rows, question] > 0
                stack += [(rows[~yes], node, 2, asked_first[1:]), (rows[yes], node, 1, [])]
        question_, yes_, no_, leaf = np.array(self.nodes, dtype=np.int64).T
        count, mean, variance = (np.array(part) for part in zip(*self.leaves, strict=True))
        return Tree(question_, yes_, no_, leaf, count, mean, variance)

    def telling(self, rows: np.ndarray, questions: list[int]) -> list[int]:
        """The questions from the first on that some of the rows answer with yes and others with no."""
        for k, question in enumerate(questions):
            if 0 < self.answers[rows, question].sum() < len(rows):
                return questions[k:]
        return []

    def gaussian(self, rows: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        s = self.sums
        if not len(rows):
            return 0.0, np.zeros(s.total.shape[1]), np.ones(s.total.shape[1])
        count, mean, variance = Sums(s.count[rows], s.total[rows], s.squares[rows]).pooled()
        return count, mean, np.maximum(variance, self.floor)

    def best_question(self, rows: np.ndarray) -> int:
        """Return the question that raises the likelihood most, or -1 if none repays its price."""
        least = max(self.growth.least_rows, 1)
        if len(rows) < 2 * least:
            return -1
        asked = self.answers[rows]
        agree = asked.sum(0)
        columns = np.flatnonzero((agree >= least) & (agree <= len(rows) - least))
        if not len(columns):
            return -1
        stacked = self.stacked[rows]
        whole = stacked.sum(0, dtype=np.float64).astype(np.float32)
        yes = asked[:, columns].T @ stacked
        no = whole - yes
        gain = self.likelihood(yes) + self.likelihood(no) - self.likelihood(whole[None])
        enough = np.minimum(yes[:, 0], no[:, 0]) >= self.growth.least_count
        gain = np.where(enough, gain, -np.inf)
        best = int(gain.argmax())
        return int(columns[best]) if gain[best] > self.price + 1e-3 else -1

    def likelihood(self, stacked: np.ndarray) -> np.ndarray:
        """Return the log likelihood of each row of sums (M, 1 + 2K) but for terms that no split changes."""
        size = self.sums.total.shape[1]
        count = np.maximum(stacked[:, :1], 1e-6)
        variance = stacked[:, 1 + size :] / count - (stacked[:, 1 : 1 + size] / count) ** 2
        floored = np.maximum(variance, self.floor.astype(np.float32))
        # a floored variance also pays for the values' real spread
        spent = np.log(floored) + np.maximum(variance, 0) / floored
        return -0.5 * stacked[:, 0] * spent.sum(1)
