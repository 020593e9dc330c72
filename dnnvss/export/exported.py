"""An exported network as a system that predicts, without the classes that trained it."""

import os
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.export.description import INPUTS, KEY, Description
from dnnvss.export.onnx_check import check_graph
from dnnvss.features import FrameCodes
from dnnvss.systems import READABLE, Example, Prediction, VisualModel
from dnnvss.systems.base import PredictionStream
from dnnvss.systems.parts import pieces

_CHUNK = 256
"""Frames a pass where each is seen by itself: the gathered rows of the first layer take 4 x active columns x units
bytes a frame."""
_REMEDY = "Export the run again: dnnvss export RUN"

Forward = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


class ExportedModel(VisualModel):
    """A network from a file of :func:`dnnvss.export.write.write_network`. Open with :meth:`open`.

    Args:
        description: what the file says of itself.
        forward: from active columns (T, A) int64 and numbers (T, N) float32 to means and variances (T, W, D).
    """

    reads = READABLE

    def __init__(self, description: Description, forward: Forward) -> None:
        super().__init__(description.table, description.clock)
        self.description, self.forward = description, forward

    @classmethod
    def open(cls, path: Path) -> "ExportedModel":
        """Return the network in an ONNX file, to be run by onnxruntime.

        What torch.export writes (``.pt2``) is for other programs: opening it runs what it holds.

        Raises:
            DnnvssError: the file is missing or damaged, does more than a network of ours does, means something else to
                this program, or onnxruntime is missing.
        """
        path = Path(path)
        if path.suffix != ".onnx":
            raise DnnvssError("is no ONNX file", file=path, remedy=_REMEDY)
        if find_spec("onnxruntime") is None:
            raise DnnvssError("running an ONNX file needs the package onnxruntime", file=path,
                              remedy='Run pip install -c constraints.txt -e ".[export]"')
        text, forward = files.read(path, _onnx, _REMEDY)
        try:
            return cls(Description.from_json(text), forward)
        except DnnvssError as error:
            raise DnnvssError(error.problem, file=path, remedy=error.remedy) from error

    def predict(self, example: Example) -> Prediction:
        """Return mean streams and variances, those of the mixture where several codes may be true."""
        parts = [self._streams(codes) for codes in (example.codes, *example.alternatives)]
        means, variances = (np.stack(side) for side in zip(*parts, strict=True))
        if len(parts) == 1:
            return Prediction(means[0], variances[0].astype(np.float64))
        between = means.var(0, dtype=np.float64) if self.description.predicted else 0.0
        return Prediction(means.mean(0), variances.mean(0, dtype=np.float64) + between)

    def fit(self, train: Sequence[Example], val: Sequence[Example], folder: Path) -> None:
        """Refuse: an exported network learns no more."""
        raise DnnvssError("an exported network cannot be trained", remedy="Train the run that it came from")

    def stream(self) -> PredictionStream:
        """Refuse: the graph takes whole utterances."""
        raise DnnvssError("a network in ONNX takes whole utterances, so it cannot speak as the sound comes",
                          remedy="Take the run, or a bundle that keeps its weights: dnnvss export RUN --network npz")

    def state(self) -> dict[str, Any]:
        """Refuse: the state is the file."""
        raise DnnvssError("an exported network is kept in its own file", remedy="Copy that file")

    def load_state(self, state: dict[str, Any]) -> None:
        """Refuse: the state is the file."""
        raise DnnvssError("an exported network is kept in its own file", remedy="Open that file")

    def _streams(self, codes: FrameCodes) -> tuple[np.ndarray, np.ndarray]:
        parts = []
        for put_in, counting in pieces(len(codes), self.description.reach, _CHUNK):
            frames = np.arange(put_in.start, put_in.stop)
            made = self.forward(codes.active(frames).astype(np.int64), codes.numeric(frames))
            parts.append([side[counting] for side in made])
        mean, variance = (np.concatenate(side) for side in zip(*parts, strict=True))
        return mean, variance


def _onnx(path: Path) -> tuple[str, Forward]:
    import onnxruntime

    check_graph(path)
    options = onnxruntime.SessionOptions()
    options.log_severity_level = 3
    options.intra_op_num_threads = int(os.environ.get("OMP_NUM_THREADS", 0))  # which it does not heed by itself
    session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])

    def forward(active: np.ndarray, numeric: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        mean, variance = session.run(None, dict(zip(INPUTS, (active, numeric), strict=True)))
        return mean, variance

    return session.get_modelmeta().custom_metadata_map.get(KEY, ""), forward
