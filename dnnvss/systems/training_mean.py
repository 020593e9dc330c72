"""Tables of classes of frames, and the mean of all of them: a null model, which every system has to beat."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from dnnvss.phones import PHONES
from dnnvss.systems.base import Example, Prediction, VisualModel, pooled


class TableModel(VisualModel):
    """A model whose learnt state is a mean and a variance a class of frames, (classes, W, D) each."""

    null = True

    def classes(self, example: Example) -> np.ndarray:
        """Return the class of each frame, shape (T,)."""
        raise NotImplementedError

    def fit(self, train: Sequence[Example], val: Sequence[Example], folder: Path) -> None:
        """Average the training frames of each class; a class never seen takes the average of all frames."""
        frames = pooled(train).astype(np.float64)
        labels = np.concatenate([self.classes(e)[e.valid] for e in train])
        self.mean_ = np.repeat(frames.mean(0)[None], len(PHONES), 0)
        least = np.maximum(1e-4 * frames.var(0), 1e-12)  # a curve of a rig may stand still throughout
        self.variance_ = np.repeat(np.maximum(frames.var(0), least)[None], len(PHONES), 0)
        for k in np.unique(labels):
            self.mean_[k] = frames[labels == k].mean(0)
            if (labels == k).sum() > 1:
                self.variance_[k] = np.maximum(frames[labels == k].var(0), least)

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
    """The mean of all training frames, whatever is said."""

    system = "training_mean"
    reads: ClassVar[frozenset[str]] = frozenset()

    def classes(self, example: Example) -> np.ndarray:
        """Return zero for every frame."""
        return np.zeros(len(example.codes), dtype=np.int64)
