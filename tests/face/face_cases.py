"""A face of a few points or of none at all, for tests of what is written against the protocol alone."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Self

import numpy as np

from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.face.base import Gauge, name_groups


@dataclass(frozen=True)
class LinearFace:
    """Points (P, 2) that move with each parameter by ``modes`` (D, P, 2), and whatever gauges a test gives it."""

    kind: ClassVar[str] = "linear"

    mean: np.ndarray
    modes: np.ndarray
    gauges: Mapping[str, Gauge] = field(default_factory=dict)
    contours: Mapping[str, Sequence[int]] = field(default_factory=dict)
    unit: str = "px"

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(f"mode{i + 1}" for i in range(len(self.modes)))

    @property
    def deviations(self) -> np.ndarray:
        return np.ones(len(self.modes))

    @property
    def groups(self) -> dict[str, tuple[int, ...]]:
        return name_groups(self.names)

    def points(self, parameters: np.ndarray) -> np.ndarray:
        return self.mean + np.tensordot(parameters, self.modes, axes=1)

    def jacobian(self) -> np.ndarray:
        return self.modes

    def save(self, path: Path) -> Path:
        return files.write_arrays(path, mean=self.mean, modes=self.modes)

    @classmethod
    def load(cls, path: Path) -> Self:
        arrays = read_arrays(path)
        return cls(arrays["mean"], arrays["modes"])


def rig(curves: int) -> LinearFace:
    """A face of named numbers: no points, no gauges."""
    return LinearFace(np.zeros((0, 2)), np.zeros((curves, 0, 2)))
