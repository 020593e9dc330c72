"""A clip as parameters of the model, with what is needed to put it back into its picture."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.archives import Held, read_declared
from dnnvss.face.outliers import OUTLIER_ARRAYS, outlier_arrays, outliers_in

_ARRAYS = {
    "parameters": Held(("F", "D")), "pose": Held(("F", 4)), "shape_offset": Held(("P", 2)),
    "texture_offset": Held(("N", 3)), "valid": Held(("F",), "b"), **OUTLIER_ARRAYS}


@dataclass(frozen=True)
class ClipCode:
    """A clip as parameters of the model, with what is needed to put it back into its picture.

    Args:
        parameters: (F, D) float32; frames that were not measured are interpolated between their neighbours.
        pose: (F, 4) float32, smoothed head pose (see :mod:`dnnvss.face.pose`).
        shape_offset: (P, 2) float32, the clip's mean shape less the model's.
        texture_offset: (N, 3) float32, the clip's mean texture less the model's.
        valid: (F,) bool; False where the landmarks were, or where the frame is an outlier, and the gap is longer than
            a line may bridge (:data:`dnnvss.timing.BRIDGE`).
        outliers: reason to the frames that are outliers for it.
    """

    parameters: np.ndarray
    pose: np.ndarray
    shape_offset: np.ndarray
    texture_offset: np.ndarray
    valid: np.ndarray
    outliers: dict[str, list[int]] = field(default_factory=dict)

    def save(self, path: str | Path, **more: np.ndarray) -> Path:
        """Write the code, and ``more`` arrays beside it, as ``.npz`` and return the path."""
        return files.write_arrays(
            path, parameters=self.parameters, pose=self.pose, shape_offset=self.shape_offset,
            texture_offset=self.texture_offset.astype(np.float16), valid=self.valid,
            **outlier_arrays(self.outliers, len(self.valid)), **more)

    @classmethod
    def load(cls, path: str | Path) -> "ClipCode":
        """Return a code that :meth:`save` wrote.

        Raises:
            DnnvssError: the file is missing or damaged.
        """
        remedy = "Delete it and run the command again"
        arrays = read_declared(path, _ARRAYS, remedy)
        return cls(arrays["parameters"], arrays["pose"], arrays["shape_offset"],
                   arrays["texture_offset"].astype(np.float32), arrays["valid"], outliers_in(arrays))
