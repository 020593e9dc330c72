"""A take as curves of a rig."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.archives import Held, read_declared

_ARRAYS = {"parameters": Held(("F", "D")), "valid": Held(("F",), "b")}
_REMEDY = "Delete it and run the command again"


@dataclass(frozen=True)
class RigCode:
    """A take as curves: nothing is taken out of it, so nothing is needed to put it back.

    Args:
        parameters: (F, D) float32; frames that were not measured are interpolated.
        valid: (F,) bool, whether a frame was measured, or lies in a short gap.
    """

    parameters: np.ndarray
    valid: np.ndarray
    outliers: Mapping[str, Sequence[int]] = field(default_factory=dict)

    def save(self, path: Path, **more: np.ndarray) -> Path:
        """Write the code, and ``more`` arrays beside it, as ``.npz``; return the path."""
        return files.write_arrays(path, parameters=self.parameters, valid=self.valid, **more)

    @classmethod
    def load(cls, path: Path) -> "RigCode":
        """The code that :meth:`save` wrote.

        Raises:
            DnnvssError: the file is missing or damaged.
        """
        arrays = read_declared(path, _ARRAYS, _REMEDY)
        return cls(arrays["parameters"], arrays["valid"])
