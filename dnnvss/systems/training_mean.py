"""Tables of classes of frames, and the mean of all of them: a null model, which every system has to beat."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from dnnvss.phones import PHONES
from dnnvss.systems.base import Example, Prediction, VisualModel


class TableModel(VisualModel):
    """A model whose learnt state is a mean and a variance a class of frames, (classes, W, D) each."""

    null = True

    def classes(self, example: Example) -> np.ndarray:
        """Return the class of each frame, shape (T,)."""
        raise NotImplementedError

    def fit(self, train: Sequence[Example], val: Sequence[Example], folder: Path) -> None:
        """Average the training frames of each class; a class never seen takes the average of all frames.

        Utterance by utterance, twice: a large corpus is never copied.
        """
        shape = train[0].measured[0].shape[1:]
        counts, totals = np.zeros(len(PHONES)), np.zeros((len(PHONES), int(np.prod(shape))))
        for members, frames in self._members(train):
            counts += members.sum(axis=1)
            totals += members @ frames
        middle = totals.sum(axis=0) / counts.sum()
        means = np.where(counts[:, None] > 0, totals / np.maximum(counts, 1)[:, None], middle)
        inside, around = np.zeros_like(means), np.zeros_like(middle)
        for members, frames in self._members(train):
            inside += members @ (frames - members.T @ means) ** 2
            around += ((frames - middle) ** 2).sum(axis=0)
        variance = around / counts.sum()
        least = np.maximum(1e-4 * variance, 1e-12)  # a curve of a rig may stand still throughout
        own = np.where(counts[:, None] > 1, inside / np.maximum(counts, 1)[:, None], variance)
        self.mean_, self.variance_ = (x.reshape(-1, *shape) for x in (means, np.maximum(own, least)))

    def _members(self, train: Sequence[Example]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Of each utterance's valid frames which is of which class, ones and zeros (classes, n), and what they are
        (n, W * D)."""
        for example in train:
            targets, valid = example.measured
            frames = targets[valid].reshape(int(valid.sum()), targets[0].size).astype(np.float64)
            yield (self.classes(example)[valid] == np.arange(len(PHONES))[:, None]).astype(np.float64), frames

    def predict(self, example: Example) -> Prediction:
        """Return the mean and variance of each frame's class."""
        labels = self.classes(example)
        return Prediction(self.mean_[labels], self.variance_[labels])

    def state(self) -> dict[str, Any]:
        """Return the two tables."""
        return {"mean": self.mean_, "variance": self.variance_}

    def load_state(self, state: dict[str, Any]) -> None:
        """Take over the two tables."""
        self.mean_, self.variance_ = state["mean"], state["variance"]


class TrainingMean(TableModel):
    """The mean of all training frames, whatever is said: a face that stands still."""

    system = "training_mean"
    reads: ClassVar[frozenset[str]] = frozenset()

    def classes(self, example: Example) -> np.ndarray:
        """Return zero for every frame."""
        return np.zeros(len(example.codes), dtype=np.int64)

    def predict(self, example: Example) -> Prediction:
        """Return the mean without the slopes that clips which were cut short have on average: they would move it."""
        found = super().predict(example)
        found.mean[:, 1:] = 0.0
        return found
