"""Zero mean and unit variance for the numeric columns; binary columns stay 0 and 1."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.features.codes import FrameCodes

FLOOR = 1e-3
"""A standard deviation below this is taken for that of a constant column, which becomes zero."""
_CHUNK, _VALUES = 65536, 1 << 22  # frames, and values, worked out at once at most


@dataclass(frozen=True)
class NumericScaler:
    """The mean and standard deviation of each numeric column over the training frames.

    **Source**: Thangthai 2016, section 5: "numerical input ... normalised to zero-mean unit-variance".

    Args:
        mean, deviation: float32 (N,) in the order of the table's numeric columns; a constant column has deviation 1.
    """

    mean: np.ndarray
    deviation: np.ndarray

    @classmethod
    def fit(cls, codes: FrameCodes, frames: np.ndarray | None = None) -> "NumericScaler":
        """Return the scaler of some frames of a store, all by default, in two passes over chunks."""
        frames = np.arange(len(codes)) if frames is None else np.asarray(frames)
        if not len(frames):
            raise DnnvssError("no training frame to scale features by", remedy="Give at least one training utterance")
        rows = min(_CHUNK, _VALUES // max(codes.table.numeric_width, 1) + 1)
        chunks = [frames[i : i + rows] for i in range(0, len(frames), rows)]
        mean = sum(codes.numeric(c).sum(0, dtype=np.float64) for c in chunks) / len(frames)
        square = sum(((codes.numeric(c) - mean) ** 2).sum(0) for c in chunks) / len(frames)
        deviation = np.sqrt(square)
        return cls(mean.astype(np.float32), np.where(deviation < FLOOR, 1, deviation).astype(np.float32))

    def __call__(self, values: Any) -> Any:
        """Return values (B, N), array or tensor, with the mean taken off and divided by the deviation."""
        if isinstance(values, np.ndarray):
            return (values - self.mean) / self.deviation
        mean, deviation = values.new_tensor(self.mean), values.new_tensor(self.deviation)
        return (values - mean) / deviation

    def describe(self) -> dict[str, list[float]]:
        """Return plain containers for the checkpoint."""
        return {"mean": self.mean.tolist(), "deviation": self.deviation.tolist()}

    @classmethod
    def from_description(cls, description: Mapping[str, Any]) -> "NumericScaler":
        """Return the scaler that :meth:`describe` described."""
        return cls(np.array(description["mean"], np.float32), np.array(description["deviation"], np.float32))
