"""The sound of a talker in its principal components, and another voice moved towards it."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from dnnvss.systems.canonical import Moments

VOICES = ("as_is", "offset", "offset_and_scale")


@dataclass(frozen=True)
class VoiceSpace:
    """Principal components of the columns of labels, each column in its standard deviations.

    Args:
        mean, deviation: of the columns (r,).
        components: (r, p).
        centre, spread: mean and deviation of the components (p,) in an utterance of the training, on average.
    """

    mean: np.ndarray
    deviation: np.ndarray
    components: np.ndarray
    centre: np.ndarray
    spread: np.ndarray

    @classmethod
    def fit(cls, utterances: Sequence[np.ndarray], share: float) -> "VoiceSpace":
        """The space of the rows (n, r) of utterances that explains a share of their variance.

        **Source**: Cosker et al. 2004, equations 4 and 5.
        """
        moments = Moments.of(utterances)
        deviation = np.sqrt(np.diag(moments.covariance))
        deviation = np.where(deviation > 1e-9, deviation, 1)
        values, vectors = np.linalg.eigh(moments.covariance / np.multiply.outer(deviation, deviation))
        values, vectors = np.maximum(values[::-1], 0), vectors[:, ::-1]
        kept = int(np.searchsorted(np.cumsum(values), share * values.sum() * (1 - 1e-9))) + 1
        kept = min(kept, int((values > 1e-9 * values[0]).sum()))
        bare = cls(moments.mean, deviation, vectors[:, :kept], np.zeros(kept), np.ones(kept))
        each = [bare(rows) for rows in utterances if len(rows) > 1]
        return cls(bare.mean, bare.deviation, bare.components, np.mean([e.mean(axis=0) for e in each], axis=0),
                   np.mean([e.std(axis=0) for e in each], axis=0))

    def __call__(self, rows: np.ndarray, voice: str = "as_is") -> np.ndarray:
        """The components (T, p) of an utterance (T, r).

        Args:
            rows: the columns of labels.
            voice: ``as_is``; ``offset`` moves the utterance's mean to that of an utterance of the training;
                ``offset_and_scale`` its deviations too. Both look at the whole utterance.

        **Source**: Cosker et al. 2004, section 7: voices whose distribution was offset or scaled led to poor animation.
        """
        sound = (rows - self.mean) / self.deviation @ self.components
        if voice == "as_is":
            return sound
        scale = self.spread / np.maximum(sound.std(axis=0), 1e-6) if voice == "offset_and_scale" else 1.0
        return (sound - sound.mean(axis=0)) * scale + self.centre

    def state(self) -> dict[str, np.ndarray]:
        """The arrays by name."""
        return asdict(self)

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> "VoiceSpace":
        """The space of :meth:`state`."""
        return cls(**state)
