"""A clip as parameters of a face of points."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.archives import Held, read_declared
from dnnvss.face.outliers import OUTLIER_ARRAYS, outlier_arrays, outliers_in

_ARRAYS = {
    "parameters": Held(("F", "D")), "pose": Held(("F", "pose")), "shape_offset": Held(("P", "d")),
    "valid": Held(("F",), "b"), **OUTLIER_ARRAYS}
_REMEDY = "Delete it and run the command again"


@dataclass(frozen=True)
class PointsCode:
    """A clip as parameters, with what is needed to put it back where it was recorded.

    Args:
        parameters: (F, D) float32; frames that were not measured are interpolated between their neighbours.
        pose: (F, 4 or 12) float32, smoothed head pose (see :mod:`dnnvss.face.points.pose`).
        shape_offset: (P, 2 or 3) float32, the clip's mean shape less the face's.
        valid: (F,) bool; False where the landmarks were, or where the frame is an outlier, and the gap is longer than
            a line may bridge (:data:`dnnvss.timing.BRIDGE`).
        outliers: reason to the frames that are outliers for it.
    """

    parameters: np.ndarray
    pose: np.ndarray
    shape_offset: np.ndarray
    valid: np.ndarray
    outliers: dict[str, list[int]] = field(default_factory=dict)

    def save(self, path: Path, **more: np.ndarray) -> Path:
        """Write the code, and ``more`` arrays beside it, as ``.npz``; return the path."""
        return files.write_arrays(path, parameters=self.parameters, pose=self.pose, shape_offset=self.shape_offset,
                                  valid=self.valid, **outlier_arrays(self.outliers, len(self.valid)), **more)

    @classmethod
    def load(cls, path: Path) -> "PointsCode":
        """The code that :meth:`save` wrote.

        Raises:
            DnnvssError: the file is missing or damaged.
        """
        arrays = read_declared(path, _ARRAYS, _REMEDY)
        return cls(arrays["parameters"], arrays["pose"], arrays["shape_offset"], arrays["valid"], outliers_in(arrays))
