"""Writes a trained system as ONNX or as a torch.export program."""

import logging
import warnings
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import torch
from torch import nn

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.export.description import INPUTS, KEY, OUTPUTS, SUFFIXES, Description
from dnnvss.export.graph import FrameStreams
from dnnvss.export.recurrence import portable


def write_network(path: Path, streams: FrameStreams, description: Description) -> Path:
    """Write the network with its description and return the path; the number of frames stays free.

    Raises:
        DnnvssError: another suffix than ``.onnx`` or ``.pt2``, or a package that writing ONNX needs is missing.
    """
    if path.suffix not in SUFFIXES:
        raise DnnvssError(f"a network cannot be written as {path.suffix or 'a folder'}", file=path,
                          remedy=f"Use one of {', '.join(SUFFIXES)}")
    if path.suffix == ".onnx" and (missing := [p for p in ("onnx", "onnxscript") if find_spec(p) is None]):
        raise DnnvssError(f"writing ONNX needs the package {missing[0]}", file=path,
                          remedy='Run pip install -c constraints.txt -e ".[export]", or write .pt2')
    program = _program(portable(streams, onnx=path.suffix == ".onnx").eval(), description)
    with files.replacing(path) as temporary:
        if path.suffix == ".pt2":
            torch.export.save(program, temporary, extra_files={KEY: description.to_json()})
        else:
            _onnx(program, description).save(temporary, external_data=False)
    return path


def _program(streams: nn.Module, description: Description) -> Any:
    """Return the graph of any number of frames."""
    table = description.table
    active = torch.full((3, table.active_width), table.binary_width, dtype=torch.int64)
    numeric = torch.zeros(3, table.numeric_width)
    frames = torch.export.Dim("frames", min=1)
    return torch.export.export(streams, (active, numeric), dynamic_shapes=({0: frames}, {0: frames}))


def _onnx(program: Any, description: Description) -> Any:
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)  # it tells of torchvision, which nobody needs here
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # torch's own deprecations while it translates
        written = torch.onnx.export(program, dynamo=True, input_names=list(INPUTS), output_names=list(OUTPUTS),
                                    verbose=False)
    assert written is not None
    written.model.metadata_props[KEY] = description.to_json()
    return written
