"""What runs the nets: LiteRT where it is installed, twice as fast, else OpenCV, to the same points within .1 pixel."""

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import Any

import cv2
import numpy as np

from dnnvss.staging import scratch

Net = Callable[[np.ndarray], list[np.ndarray]]
"""From a picture (H, W_, 3) float32 to the outputs of a net, in the order in which they were asked for."""


@cache
def litert() -> Any:
    """The class ``Interpreter`` of LiteRT (``ai-edge-litert``), None where it is not installed."""
    try:
        from ai_edge_litert.interpreter import Interpreter
    except ImportError:
        return None
    return Interpreter


def engine() -> str:
    """The name of what runs the nets here; points that another one found are found anew."""
    return "opencv" if litert() is None else "litert"


def load(weights: bytes, outputs: Sequence[str]) -> Net:
    """A net, run on one thread: preparing gives every core a recording of its own.

    Args:
        weights: the TFLite file.
        outputs: names of the outputs.
    """
    return _opencv(weights, outputs) if litert() is None else _litert(weights, outputs)


def _litert(weights: bytes, outputs: Sequence[str]) -> Net:
    with _hushed():
        net = litert()(model_content=weights, num_threads=1)
        net.allocate_tensors()
    (into,) = net.get_input_details()
    places = {place["name"]: place["index"] for place in net.get_output_details()}

    def run(picture: np.ndarray) -> list[np.ndarray]:
        net.set_tensor(into["index"], picture[None])
        net.invoke()
        return [net.get_tensor(places[name]) for name in outputs]

    return run


@contextmanager
def _hushed() -> Iterator[None]:
    """A while in which nothing is written to standard error: LiteRT tells there, past Python, that it starts."""
    kept, nothing = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nothing, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nothing)


def _opencv(weights: bytes, outputs: Sequence[str]) -> Net:
    """A net in OpenCV, whose version 5 reads it rightly by the classic engine alone, and that from a path alone."""
    classic = getattr(cv2.dnn, "ENGINE_CLASSIC", None)
    with scratch() as folder:
        file = folder / "net.tflite"
        file.write_bytes(weights)
        net = cv2.dnn.readNetFromTFLite(str(file), *(() if classic is None else (classic,)))

    def run(picture: np.ndarray) -> list[np.ndarray]:
        net.setInput(picture.transpose(2, 0, 1)[None])
        return [np.asarray(found) for found in net.forward(list(outputs))]

    return run
